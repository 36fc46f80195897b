"""Sections of a recipe, and checks between them."""
