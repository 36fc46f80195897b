"""A clip as plain numbers in JSON, for programs that have no USD."""

import numpy as np
import numpy.typing as npt
import orjson

from service.encode import axes, tables
from service.encode.convention import Convention
from service.encode.tables import Table
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
LENGTHS = {1.0: "metre", 0.01: "centimetre"}
DECIMALS = 6
"""A micrometre; float32 keeps little more for a joint a few metres away."""


def json(answer: ClipAnswer, convention: Convention) -> bytes:
    """One JSON object: the skeleton, every frame's rotations and root position, and the trust.

    Rounded, unlike the table: nobody reads a micrometre, and digits are what JSON takes time for.
    """
    clip = axes.moved(convention, answer.clip)
    content = {
        "units": units(convention),
        "names": clip.skeleton.names,
        "parents": clip.skeleton.parents,
        "rate": clip.rate,
        "frames": len(clip),
        "times": np.round(times(clip), DECIMALS),
        **{name: _short(values) for name, values in tracks(clip).items()},
        "trust": answer.trust.facts(),
    }
    return orjson.dumps(content, option=orjson.OPT_SERIALIZE_NUMPY)


def table(answer: ClipAnswer, convention: Convention) -> Table:
    """The same as a table, one row a frame; bone offsets hold for all."""
    clip = axes.moved(convention, answer.clip)
    numbers = {name: tables.single(values) for name, values in tracks(clip).items()}
    fixed = {"bone_offsets": numbers.pop("bone_offsets")}
    facts = {
        "names": list(clip.skeleton.names),
        "parents": list(clip.skeleton.parents),
        "rate": clip.rate,
        "units": units(convention),
        "trust": answer.trust.facts(),
    }
    return Table({"times": times(clip), **numbers}, facts, fixed)


def units(convention: Convention) -> dict[str, str]:
    """What the numbers of a file in a convention are."""
    metres = convention.metres_per_unit
    length = LENGTHS.get(metres, f"{metres:g} metres")
    return UNITS | {"length": length, "up": convention.up.upper()}


def times(clip: Clip) -> Floats:
    """When each frame is (F,), s."""
    return np.arange(len(clip)) / clip.rate


def tracks(clip: Clip) -> dict[str, Floats]:
    """Rotations (F, J, 4), the root's position (F, 3) and bone offsets (J, 3)."""
    # The root has a path and no bone.
    offsets = np.concatenate([np.zeros((1, 3)), clip.translations[0, 1:]])
    return {"rotations": clip.rotations, "root_position": clip.root_path, "bone_offsets": offsets}


def _short(values: Floats) -> npt.NDArray[np.float32]:
    return np.ascontiguousarray(np.round(values, DECIMALS), dtype=np.float32)
