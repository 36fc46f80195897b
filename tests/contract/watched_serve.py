"""`posefield serve` with a log on file descriptor WATCH of system accesses that contain the canary.

With PLANT set, a model's name is first looked up as a file, as a check of the detection.
"""

import os
import sys
from pathlib import Path

CANARY, SINK = "canary", int(os.environ["WATCH"])


def tell(event, arguments):
    said = f"{event} {arguments!r}"
    if CANARY in said.lower():
        os.write(SINK, said[:300].encode("ascii", "replace") + b"\n")


sys.addaudithook(tell)

from posefield import cli  # noqa: E402
from posefield.registry.model_registry import ModelRegistry  # noqa: E402

if os.environ.get("PLANT"):
    find = ModelRegistry.find

    def careless(self, key):
        try:
            Path("/models", f"{key}.onnx").read_bytes()
        except (OSError, ValueError):
            return find(self, key)

    ModelRegistry.find = careless

cli.main()
