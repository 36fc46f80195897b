"""Triton model of a model file: onnxruntime in Triton's Python backend, since no package has
Triton's onnxruntime backend."""

import os
import sys
from pathlib import Path

# Triton's interpreter has a path of its own.
sys.path.append(os.environ["PACKAGES"])

import onnxruntime
import triton_python_backend_utils as triton


class TritonPythonModel:
    """The graph as it is: inputs by their names, outputs by theirs."""

    @staticmethod
    def auto_complete_config(config):
        """Ports as the file has them."""
        config.set_max_batch_size(0)
        session = _session(Path(__file__).parent)
        for port in session.get_inputs():
            config.add_input(_port(port))
        for port in session.get_outputs():
            config.add_output(_port(port))
        return config

    def initialize(self, args):
        """Open the file beside this one."""
        self.session = _session(Path(__file__).parent)

    def execute(self, requests):
        """Answers to requests, one by one."""
        return [self._answer(request) for request in requests]

    def _answer(self, request):
        feed = {tensor.name(): tensor.as_numpy() for tensor in request.inputs()}
        names = list(request.requested_output_names())
        made = zip(names, self.session.run(names, feed), strict=True)
        return triton.InferenceResponse([triton.Tensor(*pair) for pair in made])


def _session(folder):
    (path,) = folder.glob("*.onnx")
    return onnxruntime.InferenceSession(path, providers=["CPUExecutionProvider"])


def _port(port):
    dims = [size if isinstance(size, int) else -1 for size in port.shape]
    return {"name": port.name, "data_type": "TYPE_FP32", "dims": dims}
