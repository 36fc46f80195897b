"""Robots: bodies and hinges, and their reference motions in the files of other programs."""
