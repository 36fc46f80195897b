"""Crowd poses as tables of one row per character."""

from typing import Any

import numpy as np

from service.encode.keyframes import UNITS
from service.encode.tables import Column, Table, single
from service.motion.crowd import CrowdPoses

JSON_LIMIT = 1000
"""Largest number of characters in JSON, 2.6 MB at 31 joints; larger crowds need a binary format."""


def table(poses: CrowdPoses) -> Table:
    """Return a table of N rows, with the facts of the whole block."""
    return Table(_columns(poses), _facts(poses))


def _columns(poses: CrowdPoses) -> dict[str, Column]:
    found = {name: single(getattr(poses, name)) for name in _SINGLES}
    found["supported"] = poses.supported
    # A question names levels up to 127.
    found["levels"] = poses.levels.astype(np.int8)
    if poses.error_px is not None:
        found["error_px"] = single(poses.error_px)
    return found


_UNITS = ("length", "time", "rotation", "up", "handedness")
_SINGLES = ("rotations", "root_position", "bone_offsets", "duration", "sigma")


def _facts(poses: CrowdPoses) -> dict[str, Any]:
    return {
        "model": poses.model,
        "names": list(poses.skeleton.names),
        "parents": list(poses.skeleton.parents),
        "units": {name: UNITS[name] for name in _UNITS} | {"error_px": "pixel", "frame": "world"},
        "warnings": list(poses.warnings),
    }
