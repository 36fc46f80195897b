"""Families of found clips: their recipes and tables, the page to look at, and its decisions."""
