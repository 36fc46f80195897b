"""Builder of ONNX graphs."""
