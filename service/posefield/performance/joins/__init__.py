"""Joins of a performance: cuts, blends, steps over them, and how hard they are."""
