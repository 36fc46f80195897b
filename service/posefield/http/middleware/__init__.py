"""HTTP features of every request: caching, compression, CORS, negotiation, deadlines."""
