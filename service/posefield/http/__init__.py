"""HTTP layer: the API contract, its operations and the server process."""
