"""Errors, units, files, cancellation: used by every other package."""
