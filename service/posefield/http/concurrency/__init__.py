"""Threads of a worker, and batching of concurrent requests."""
