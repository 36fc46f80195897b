"""USD layers: metadata, prims, facts, and templates that are filled in."""
