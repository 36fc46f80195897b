"""Clips and poses as plain arrays: JSON and tables."""

from typing import Any

import numpy as np
import numpy.typing as npt

from posefield.common.units import Floats
from posefield.encode.files import file_convention
from posefield.encode.files.file_convention import Convention
from posefield.encode.tables import table as tables
from posefield.encode.tables.table import Table
from posefield.motion.clip import Clip
from posefield.question.results import PoseAnswer, SampledClip

UNITS = {
    "length": "metre",
    "time": "second",
    "rate": "frames a second",
    "rotation": "unit quaternion w x y z, local to the parent",
    "up": "Y",
    "handedness": "right",
}
LENGTH_UNITS = {1.0: "metre", 0.01: "centimetre"}
DECIMALS = 6
"""Decimals of lengths in JSON: a micrometre, near float32's precision a few metres away."""


def clip_json(answer: SampledClip, convention: Convention) -> bytes:
    """Return one JSON object: the skeleton, all rotations and root positions, and provenance.

    Numbers are rounded, unlike those of `table`, since the time to write JSON grows with its
    digits.
    """
    clip = file_convention.convert_clip(convention, answer.clip)
    content = {
        "units": unit_names(convention),
        "names": clip.skeleton.names,
        "parents": clip.skeleton.parents,
        **_curve_names(clip),
        "rate": clip.rate,
        "frames": len(clip),
        "times": np.round(frame_times(clip), DECIMALS),
        **{name: _rounded(values) for name, values in motion_arrays(clip).items()},
        "trust": answer.trust.document(),
    }
    return tables.json_object(content)


def table(answer: SampledClip, convention: Convention) -> Table:
    """Return the clip as a table of one row per frame; bone offsets are one array for all."""
    clip = file_convention.convert_clip(convention, answer.clip)
    numbers = {name: tables.as_float32(values) for name, values in motion_arrays(clip).items()}
    fixed = {"bone_offsets": numbers.pop("bone_offsets")}
    facts = {
        "names": list(clip.skeleton.names),
        "parents": list(clip.skeleton.parents),
        **_curve_names(clip),
        "rate": clip.rate,
        "units": unit_names(convention),
        "trust": answer.trust.document(),
    }
    return Table({"times": frame_times(clip), **numbers}, facts, fixed)


def unit_names(convention: Convention) -> dict[str, str]:
    """Return the units of a file in a convention."""
    metres = convention.metres_per_unit
    length = LENGTH_UNITS.get(metres, f"{metres:g} metres")
    return UNITS | {"length": length, "up": convention.up.upper()}


def frame_times(clip: Clip) -> Floats:
    """Return the time of each frame (F,), s."""
    return np.arange(len(clip)) / clip.rate


def motion_arrays(clip: Clip) -> dict[str, Floats]:
    """Return rotations (F, J, 4), root positions (F, 3) and bone offsets (J, 3).

    In the unit of the clip; the root's offset is zero. A clip with curves has their values (F, C).
    """
    # The root has a path and no bone.
    offsets = np.concatenate([np.zeros((1, 3)), clip.translations[0, 1:]])
    curves = {} if clip.curves is None else {"curves": clip.curves.values}
    return {
        "rotations": clip.rotations,
        "root_position": clip.root_path,
        "bone_offsets": offsets,
        **curves,
    }


def _curve_names(clip: Clip) -> dict[str, list[str]]:
    """Return the names of a clip's curves, in the order of their values; nothing without them."""
    return {} if clip.curves is None else {"curve_names": clip.curves.names}


def _rounded(values: Floats) -> npt.NDArray[np.float32]:
    return np.ascontiguousarray(np.round(values, DECIMALS), dtype=np.float32)


def pose_table(answer: PoseAnswer[Any]) -> Table:
    """Return a table of S rows; bone offsets are one array for all times."""
    curves = {} if answer.curves is None else {"curves": tables.as_float32(answer.curves)}
    return Table(
        {
            "times": answer.times,
            "rotations": tables.as_float32(answer.rotations),
            "root_position": tables.as_float32(answer.root_position),
            **curves,
        },
        {"trust": answer.trust.document()},
        {"bone_offsets": tables.as_float32(answer.bone_offsets)},
    )
