"""Poses as plain numbers in JSON."""

from typing import Any

import numpy as np
import orjson

from service.motion.answer import PoseAnswer
from service.motion.conventions import Floats, Singles


def json(answer: PoseAnswer[Any]) -> bytes:
    """One JSON object: schema PoseAnswer of the contract."""
    content = {
        "trust": answer.trust.facts(),
        "times": answer.times.tolist(),
        "rotations": _short(answer.rotations),
        "root_position": _short(answer.root_position),
        "bone_offsets": _short(answer.bone_offsets),
    }
    return orjson.dumps(content, option=orjson.OPT_SERIALIZE_NUMPY)


def _short(values: Floats | Singles) -> Any:
    """The same as float32, which is what the model answers and takes half the digits."""
    return np.ascontiguousarray(values, dtype=np.float32)
