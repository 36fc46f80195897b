"""Temporal alignment: dynamic time warping, warps, cycles and travel."""
