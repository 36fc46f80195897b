"""Curves of clips: the keys of a recipe that describe them, and the files that hold them."""
