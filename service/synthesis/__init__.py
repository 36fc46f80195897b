"""A model file to poses and clips."""
