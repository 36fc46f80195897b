"""Training: a folder of example motions to one .onnx model file."""
