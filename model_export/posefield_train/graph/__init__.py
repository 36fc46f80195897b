"""The model, its levels of detail and its file."""
