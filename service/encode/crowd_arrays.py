"""Crowds as plain arrays in one .npz file, in world space."""

from io import BytesIO
from pathlib import Path

import numpy as np

from service.motion import files, quat
from service.motion.conventions import Singles
from service.motion.crowd import CrowdClip


def write(crowd: CrowdClip, path: Path) -> None:
    """Write a crowd to an .npz file.

    rotations: (N, F, J, 4). root_position: (N, F, 3), m. bone_offsets: (N, J, 3), m. rate: frames a
    second. joints: names. Raises FileError if the file cannot be written.
    """
    made = list(crowd.batches)
    rotations, roots, bones = (
        np.concatenate([getattr(motions, part) for motions in made])[crowd.motion]
        for part in _PARTS
    )
    turned, moved = _placed(crowd, rotations, roots)
    content = BytesIO()
    np.savez(
        content,
        rotations=turned,
        root_position=moved,
        bone_offsets=bones,
        rate=crowd.rate,
        joints=np.array(crowd.skeleton.names),
    )
    files.write(content.getvalue(), path)


_PARTS = ("rotations", "root_position", "bone_offsets")


def _placed(crowd: CrowdClip, rotations: Singles, roots: Singles) -> tuple[Singles, Singles]:
    """Return rotations and root positions of all characters in the world."""
    turns = crowd.placement.turns[:, None]
    own = quat.mul(turns, rotations[:, :, 0].astype(np.float64))
    moved = quat.rotate(turns, roots.astype(np.float64)) + crowd.placement.positions[:, None]
    placed = rotations.copy()
    placed[:, :, 0] = own
    return placed, moved.astype(np.float32)
