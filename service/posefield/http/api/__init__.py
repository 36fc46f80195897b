"""The API contract, its problems and the settings of the service."""
