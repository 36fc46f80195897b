"""Clips, poses and crowds as plain arrays: JSON and tables, crowds with a row per character."""

from pathlib import Path
from typing import Any

import numpy as np

from posefield.common.units import Floats
from posefield.encode import character
from posefield.encode import table as tables
from posefield.encode.character import Convention
from posefield.encode.table import Column, Table, as_float32
from posefield.motion import quat
from posefield.motion.clip import Clip, CrowdClip, CrowdPoses
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
    clip = character.convert_clip(convention, answer.clip)
    content = {
        "units": unit_names(convention),
        "names": clip.skeleton.names,
        "parents": clip.skeleton.parents,
        **_curve_names(clip),
        "rate": clip.rate,
        "frames": len(clip),
        "times": np.round(frame_times(clip), DECIMALS),
        **{
            name: np.ascontiguousarray(np.round(values, DECIMALS), dtype=np.float32)
            for name, values in motion_arrays(clip).items()
        },
        "trust": answer.trust.document(),
    }
    return tables.json_object(content)


def clip_table(answer: SampledClip, convention: Convention) -> Table:
    """Return the clip as a table of one row per frame; bone offsets are one array for all."""
    clip = character.convert_clip(convention, answer.clip)
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


MAX_JSON_CHARACTERS = 1000
"""Largest number of characters in JSON, 2.6 MB at 31 joints; larger crowds need a binary format."""


def crowd_table(poses: CrowdPoses) -> Table:
    """Return a table of N rows, with the facts of the whole block."""
    return Table(_columns(poses), _facts(poses))


def _columns(poses: CrowdPoses) -> dict[str, Column]:
    columns = {name: as_float32(getattr(poses, name)) for name in _FLOAT32_ARRAYS}
    columns["supported"] = poses.supported
    # A question names levels up to 127.
    columns["levels"] = poses.levels.astype(np.int8)
    if poses.error_px is not None:
        columns["error_px"] = as_float32(poses.error_px)
    if poses.curves is not None:
        columns["curves"] = as_float32(poses.curves)
    return columns


_UNIT_NAMES = ("length", "time", "rotation", "up", "handedness")
_FLOAT32_ARRAYS = ("rotations", "root_position", "bone_offsets", "duration", "sigma")


def _facts(poses: CrowdPoses) -> dict[str, Any]:
    return {
        "model": poses.model,
        "names": list(poses.skeleton.names),
        "parents": list(poses.skeleton.parents),
        **({"curve_names": list(poses.curve_names)} if poses.curve_names else {}),
        "units": {name: UNITS[name] for name in _UNIT_NAMES}
        | {"error_px": "pixel", "frame": "world"},
        "warnings": list(poses.warnings),
    }


def write_npz(crowd: CrowdClip, path: Path) -> None:
    """Write a crowd to an .npz file.

    rotations: (N, F, J, 4). root_position: (N, F, 3), m. bone_offsets: (N, J, 3), m. rate: frames a
    second. joints: names. With curves also their values, curves: (N, F, C), and curve_names.
    """
    batches = list(crowd.batches)
    rotations, roots, bones, *curves = (
        np.concatenate([getattr(motions, name) for motions in batches])[crowd.motion]
        for name in (*_MOTION_ARRAYS, *(["curves"] if crowd.curves else []))
    )
    turns = crowd.placement.turns[:, None]
    rotations[:, :, 0] = quat.mul(turns, rotations[:, :, 0].astype(np.float64))
    world_roots = quat.rotate(turns, roots.astype(np.float64)) + crowd.placement.positions[:, None]
    arrays: dict[str, Any] = {}
    if curves:
        arrays = {"curves": curves[0], "curve_names": np.array(crowd.curves)}
    np.savez(
        path,
        rotations=rotations,
        root_position=world_roots.astype(np.float32),
        bone_offsets=bones,
        rate=crowd.rate,
        joints=np.array(crowd.skeleton.names),
        **arrays,
    )


_MOTION_ARRAYS = ("rotations", "root_position", "bone_offsets")
