"""Many clips at once: queries in, files and a manifest of them out."""
