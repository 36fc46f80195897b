"""Measures of standing feet, and the service's answers that are measured on folds."""
