"""The training report: one page with pictures, and its numbers as JSON."""
