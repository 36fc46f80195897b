"""Evaluation of models on motions that they have not seen, beside other methods."""
