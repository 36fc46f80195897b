"""Procedural sample motions, whose truth is known at every control point."""
