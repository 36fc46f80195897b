"""Models opened in onnxruntime, their levels of detail and their cost."""
