"""Retargeting: motions of a model on the skeleton of another character."""
