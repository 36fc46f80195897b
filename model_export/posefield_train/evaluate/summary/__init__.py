"""Summaries of an evaluation: of each method, and of performers."""
