"""Performances: long continuous motions of several segments, from one script."""
