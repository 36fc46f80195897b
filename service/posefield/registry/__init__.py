"""Model registry: model sources, loading and hot reload."""
