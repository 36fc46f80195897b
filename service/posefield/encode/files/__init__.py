"""Properties of files: media types, unit and axes, archives."""
