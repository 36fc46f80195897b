"""Other interpolation methods that are compared with posefield, of SciPy and scikit-learn."""
