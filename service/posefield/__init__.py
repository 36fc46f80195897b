"""The stateless motion service, its commands and the packages that training shares."""

import os

# onnxruntime's Linux wheels report to their vendor unless told otherwise before they are imported.
os.environ["ORT_DISABLE_TELEMETRY"] = "1"

__version__ = "0.3.0"
