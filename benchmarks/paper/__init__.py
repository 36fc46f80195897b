"""Table 1 of Mukai & Kuriyama, Multilinear Motion Synthesis Using Geostatistics (SCA 2006)."""
