"""A clip as plain numbers in JSON, for programs that have no USD."""

from typing import Any

import numpy as np
import numpy.typing as npt
import orjson

from service.encode.convention import Convention
from service.motion.answer import ClipAnswer
from service.motion.clip import Clip
from service.motion.conventions import Floats

UNITS = {
    "length": "metre",
    "time": "second",
    "rate": "frames a second",
    "rotation": "unit quaternion w x y z, local to the parent",
    "up": "Y",
    "handedness": "right",
}
DECIMALS = 6
"""A micrometre; float32 keeps little more for a joint a few metres away."""


def json(answer: ClipAnswer, convention: Convention) -> bytes:
    """One JSON object: the skeleton, every frame's rotations and root position, and the trust."""
    return orjson.dumps(
        {"units": UNITS, **_motion(answer.clip), "trust": answer.trust.facts()},
        option=orjson.OPT_SERIALIZE_NUMPY,
    )


def _motion(clip: Clip) -> dict[str, Any]:
    # The root has a path and no bone.
    offsets = np.concatenate([np.zeros((1, 3)), clip.translations[0, 1:]])
    return {
        "names": clip.skeleton.names,
        "parents": clip.skeleton.parents,
        "rate": clip.rate,
        "frames": len(clip),
        "times": np.round(np.arange(len(clip)) / clip.rate, DECIMALS),
        "rotations": _short(clip.rotations),
        "root_position": _short(clip.root_path),
        "bone_offsets": _short(offsets),
    }


def _short(values: Floats) -> npt.NDArray[np.float32]:
    return np.ascontiguousarray(np.round(values, DECIMALS), dtype=np.float32)
