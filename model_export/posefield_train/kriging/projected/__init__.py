"""Projected-process kriging of large families: a few inducing clips carry the weights of all."""
