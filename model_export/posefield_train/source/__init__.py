"""Motion files, tables and recipes to clips."""
