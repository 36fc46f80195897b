"""Threads of a worker, batching of concurrent requests, and whether it is ready for them."""
