"""Code shared by the service and the training job; NumPy and msgspec are its only dependencies."""
