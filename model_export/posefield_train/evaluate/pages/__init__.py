"""Charts and HTML page of an evaluation."""
