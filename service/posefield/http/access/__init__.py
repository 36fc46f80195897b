"""Authentication and authorization: API keys, bearer tokens and scopes."""
