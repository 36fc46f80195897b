"""Measures of takes and of sampled detail, for held-out clips."""
