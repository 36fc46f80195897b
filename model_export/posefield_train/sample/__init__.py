"""Procedural sample motions with a known truth at every control point."""
