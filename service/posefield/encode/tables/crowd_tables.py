"""Crowd poses as tables of one row per character."""

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from posefield.common import atomic_files
from posefield.common.units import Singles
from posefield.encode.tables.clip_tables import UNITS
from posefield.encode.tables.table import Column, Table, as_float32
from posefield.motion import quat
from posefield.motion.crowd_clip import CrowdClip, CrowdPoses

MAX_JSON_CHARACTERS = 1000
"""Largest number of characters in JSON, 2.6 MB at 31 joints; larger crowds need a binary format."""


def table(poses: CrowdPoses) -> Table:
    """Return a table of N rows, with the facts of the whole block."""
    return Table(_columns(poses), _facts(poses))


def _columns(poses: CrowdPoses) -> dict[str, Column]:
    found = {name: as_float32(getattr(poses, name)) for name in _FLOAT32_ARRAYS}
    found["supported"] = poses.supported
    # A question names levels up to 127.
    found["levels"] = poses.levels.astype(np.int8)
    if poses.error_px is not None:
        found["error_px"] = as_float32(poses.error_px)
    if poses.curves is not None:
        found["curves"] = as_float32(poses.curves)
    return found


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
    second. joints: names. With curves also their values, curves: (N, F, C), and curve_names. Raises
    FileError if the file cannot be written.
    """
    made = list(crowd.batches)
    rotations, roots, bones, *curves = (
        np.concatenate([getattr(motions, part) for motions in made])[crowd.motion]
        for part in (*_MOTION_ARRAYS, *(["curves"] if crowd.curves else []))
    )
    turned, moved = _world_motion(crowd, rotations, roots)
    content = BytesIO()
    np.savez(
        content,
        rotations=turned,
        root_position=moved,
        bone_offsets=bones,
        rate=crowd.rate,
        joints=np.array(crowd.skeleton.names),
        **_curve_arrays(crowd, curves),
    )
    atomic_files.write(content.getvalue(), path)


_MOTION_ARRAYS = ("rotations", "root_position", "bone_offsets")


def _curve_arrays(crowd: CrowdClip, curves: Sequence[Singles]) -> dict[str, Any]:
    """Return the curves (N, F, C), if there are any, and their names."""
    return {"curves": curves[0], "curve_names": np.array(crowd.curves)} if curves else {}


def _world_motion(crowd: CrowdClip, rotations: Singles, roots: Singles) -> tuple[Singles, Singles]:
    """Return rotations and root positions of all characters in the world."""
    turns = crowd.placement.turns[:, None]
    own = quat.mul(turns, rotations[:, :, 0].astype(np.float64))
    moved = quat.rotate(turns, roots.astype(np.float64)) + crowd.placement.positions[:, None]
    placed = rotations.copy()
    placed[:, :, 0] = own
    return placed, moved.astype(np.float32)
