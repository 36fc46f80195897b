"""Training report: an HTML page with charts, and its figures as JSON."""
