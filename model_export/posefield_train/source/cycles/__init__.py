"""Cycles: the closing of their seam."""
