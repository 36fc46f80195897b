"""Sessions of onnxruntime, each on one thread of the CPU, and large calls of another provider."""

import os
from contextlib import redirect_stdout
from functools import cache
from io import StringIO
from typing import Any

import numpy as np
import onnxruntime

from posefield.common.errors import InvalidField, ModelError
from posefield.inference.providers import CPU, VARIABLE, Provider

# Without it cuBLAS may sum in another order where several sessions compute at once.
CUBLAS_WORKSPACE = "CUBLAS_WORKSPACE_CONFIG", ":4096:8"


def open_session(content: bytes, source: str, provider: Provider = CPU) -> Any:
    """Return a session on an ONNX file, all of it computed by a provider.

    Raises ModelError, which names `source` and onnxruntime's reason, also where onnxruntime would
    compute on the CPU instead.
    """
    options = onnxruntime.SessionOptions()
    # A pose takes microseconds: the overhead of threads would exceed their gain.
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = 4
    # An arena keeps the memory of the longest clip in each session and saves no time.
    options.enable_cpu_mem_arena = False
    options.use_deterministic_compute = provider is not CPU
    chosen = [(provider.execution, dict(provider.options))]
    try:
        # By default onnxruntime goes on with the CPU after an error of another provider.
        opened = onnxruntime.InferenceSession(content, options, providers=chosen, enable_fallback=0)
    except Exception as fault:  # onnxruntime's exceptions share no base of their own
        raise ModelError(source, f"onnxruntime cannot load it: {first_line(fault)}") from fault
    if provider.execution not in opened.get_providers():
        found = ", ".join(opened.get_providers())
        raise ModelError(source, f"onnxruntime computes by {found}, expected {provider.execution}")
    return opened


@cache
def require_provider(provider: Provider) -> None:
    """Raise InvalidField, with the providers found, if a provider cannot compute here.

    onnxruntime lists the providers of its build, also without their libraries or a device, and
    opens sessions on the CPU instead; therefore a value is written to the device.
    """
    if provider is CPU:
        return
    os.environ.setdefault(*CUBLAS_WORKSPACE)
    listed = onnxruntime.get_available_providers()
    found = f"onnxruntime {onnxruntime.__version__} has {', '.join(listed)}"
    if provider.execution not in listed:
        said = f"{found}, expected {provider.execution}, which the package onnxruntime-gpu has"
        raise InvalidField(VARIABLE, f"{provider.name!r}, but {said}")
    missing = _preload_libraries()
    try:
        onnxruntime.OrtValue.ortvalue_from_numpy(np.zeros(1, np.float32), provider.device, 0)
    except Exception as fault:  # onnxruntime's exceptions share no base of their own
        reason = "; ".join(filter(None, [missing, first_line(fault)]))
        said = f"{found}, and no device computes: {reason}; expected a device with its driver"
        raise InvalidField(VARIABLE, f"{provider.name!r}, but {said}") from fault


def _preload_libraries() -> str:
    """Load the libraries of CUDA that lie beside this package; return a message on failure."""
    said = StringIO()
    # It prints what it cannot find, and standard output belongs to the commands.
    with redirect_stdout(said):
        onnxruntime.preload_dlls()
    return next(iter(said.getvalue().splitlines()), "")


def first_line(fault: Exception) -> str:
    """Return the first line of an exception's message, or its class where it has none."""
    return next(iter(str(fault).strip().splitlines()), type(fault).__name__)
