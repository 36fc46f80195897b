"""Motions of a user's own character: layers that refer to its file, and named animations."""
