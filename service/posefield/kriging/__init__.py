"""Kriging in NumPy: covariances, predictions, leave-one-out errors and support."""
