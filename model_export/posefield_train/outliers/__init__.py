"""Outlier detection: clips that do not fit their family."""
