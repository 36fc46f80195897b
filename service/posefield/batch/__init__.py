"""Export of many clips: queries in, files and their manifest out."""
