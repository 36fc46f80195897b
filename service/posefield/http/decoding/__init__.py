"""Decoding of requests to questions."""
