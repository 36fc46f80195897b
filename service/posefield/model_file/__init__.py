"""Model files: their card, and the checks before onnxruntime opens them."""
