"""Rows of an export: read from tables, grids or samplings, and validated."""
