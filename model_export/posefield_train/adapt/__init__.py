"""Adaptation of a trained model to new performers."""
