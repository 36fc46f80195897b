"""Terminal input and output that commands share."""
