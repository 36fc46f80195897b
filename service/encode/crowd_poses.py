"""A block of crowd poses as columns, one row a character; and as JSON, for crowds to look at."""

import json as text
from typing import Any

import numpy as np
import numpy.typing as npt
import orjson

from service.encode.keyframes import UNITS
from service.motion.crowd import CrowdPoses

JSON_LIMIT = 1000
"""Characters: 2.6 MB at 31 joints. More is for programs, which read Arrow and npz."""

Column = npt.NDArray[Any]


def columns(poses: CrowdPoses) -> dict[str, Column]:
    """Arrays of N rows by name, in the order and types in which they travel."""
    found = {name: _single(getattr(poses, name)) for name in _SINGLES}
    # A question names levels up to 127.
    found["levels"] = poses.levels.astype(np.int8)
    if poses.error_px is not None:
        found["error_px"] = _single(poses.error_px)
    return found


_UNITS = ("length", "time", "rotation", "up", "handedness")
_SINGLES = ("rotations", "root_position", "bone_offsets", "duration", "sigma")


def facts(poses: CrowdPoses) -> dict[str, Any]:
    """What holds for the whole block, as plain values."""
    return {
        "model": poses.model,
        "names": list(poses.skeleton.names),
        "parents": list(poses.skeleton.parents),
        "units": {name: UNITS[name] for name in _UNITS} | {"error_px": "pixel", "frame": "world"},
        "warnings": list(poses.warnings),
    }


def fact_texts(poses: CrowdPoses) -> dict[str, str]:
    """The same as JSON texts, for formats whose metadata are strings."""
    return {key: text.dumps(value, sort_keys=True) for key, value in facts(poses).items()}


def json(poses: CrowdPoses) -> bytes:
    """One JSON object: schema CrowdPoses of the contract; for at most JSON_LIMIT characters."""
    content = facts(poses) | columns(poses)
    return orjson.dumps(content, option=orjson.OPT_SERIALIZE_NUMPY)


def _single(values: Column) -> Column:
    return np.ascontiguousarray(values, dtype=np.float32)
