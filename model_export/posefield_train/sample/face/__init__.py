"""Procedural family of a face: a head with a jaw, and curves for blend shapes."""
