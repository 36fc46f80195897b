"""Validation of questions against a model: controls, performers, limits, open controls."""
