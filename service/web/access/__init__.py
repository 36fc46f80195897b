"""Who may ask, and what: API keys and bearer tokens, scopes, and what is said of those refused.

`door` is what the application calls; `policy` is made once from the settings.
"""
