"""Evaluation of a model file in OpenVINO.

openvino_read.py MODEL.onnx QUESTION.npz RESULT.npz
"""

import sys

import numpy as np
import openvino


def main(model, question, result):
    """Write what the graph answers in full precision."""
    read = openvino.Core().read_model(model)
    graph = openvino.compile_model(read, "CPU", {"INFERENCE_PRECISION_HINT": "f32"})
    with np.load(question) as given:
        found = graph({name: given[name] for name in given.files})
    names = [port.any_name for port in read.outputs]
    np.savez(result, **{name: found[graph.output(name)] for name in names})


if __name__ == "__main__":
    main(*sys.argv[1:])
