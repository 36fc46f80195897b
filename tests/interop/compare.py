"""Comparison of the joint positions in a reader with the expected ones."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

# Readers compute in float32, and Blender a skeleton of ten joints deep keeps 1e-6 of a metre.
FURTHEST = 1e-4
"""Largest distance of a joint from its expected place, m."""
TURNED = 1e-3
"""Largest error of an entry of a joint's rotation matrix."""

Motion = tuple[list[str], np.ndarray]
Characters = dict[str, Motion]
NOBODY: Motion = ([], np.empty((0, 0, 4, 4)))


@dataclass(frozen=True)
class Row:
    """Result of one reader with one file: the largest differences, or a fault."""

    file: str
    reader: str
    metres: float
    turn: float
    fault: str

    @property
    def good(self) -> bool:
        """Return whether the file was read correctly."""
        return not self.fault and self.metres <= FURTHEST and self.turn <= TURNED


def compare(file: str, reader: str, found: Characters, meant: dict[str, Path]) -> Row:
    """Compare a reader's characters of a file with the expected ones; the worst counts."""
    rows = [_character(file, reader, found.get(who, NOBODY), meant[who]) for who in meant]
    return Row(
        file,
        reader,
        max((row.metres for row in rows if not row.fault), default=np.nan),
        max((row.turn for row in rows if not row.fault), default=np.nan),
        "; ".join(sorted({row.fault for row in rows if row.fault})),
    )


def _character(file: str, reader: str, found: Motion, npz: Path) -> Row:
    """Joints and matrices (F, J, 4, 4) of one character against those that were meant."""
    joints, matrices = found
    with np.load(npz) as meant:
        expected, order = meant["matrices"], meant["joints"].tolist()
    fault = _fault(joints, len(matrices), order, len(expected))
    if fault:
        return Row(file, reader, np.nan, np.nan, fault)
    apart = matrices[:, [joints.index(name) for name in order]] - expected
    metres = np.linalg.norm(apart[..., :3, 3], axis=-1).max()
    return Row(file, reader, metres, np.abs(apart[..., :3, :3]).max(), "")


def _fault(joints: list[str], frames: int, order: list[str], meant: int) -> str:
    if sorted(joints) != sorted(order):
        missing = sorted(set(order) ^ set(joints))
        return f"{len(joints)} joints, expected {len(order)}; they differ in {missing[:3]}"
    if not frames:
        return "no animation"
    return "" if frames == meant else f"{frames} frames, expected {meant}"
