"""The training job: a folder of example motions in, one .onnx file out."""
