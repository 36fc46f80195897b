"""The GPU of this machine, if it has one."""

from posefield.common.errors import InvalidField
from posefield.inference import onnx_runtime
from posefield.inference.providers import CUDA


def cuda_fault():
    """The error of the CUDA provider on this machine, None where a GPU computes."""
    try:
        onnx_runtime.require_provider(CUDA)
    except InvalidField as fault:
        return str(fault)
    return None


FAULT = cuda_fault()
