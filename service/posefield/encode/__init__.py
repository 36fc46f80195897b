"""Encoders of results: USD, glTF, BVH and tables."""
