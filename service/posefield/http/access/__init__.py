"""Authentication and authorization: API keys, bearer tokens, scopes and the audit log.

The application calls `door` for each request; `policy` is made once from the settings.
"""
