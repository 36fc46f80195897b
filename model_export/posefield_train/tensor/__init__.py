"""Motion tensor, its HOSVD and its decoding to poses."""
