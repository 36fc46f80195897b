"""Clip: one motion of one skeleton, sampled at a constant rate."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import Bones, Positions, RootPath, Rotations
from posefield.common.units import Floats
from posefield.motion import skeleton
from posefield.motion.curves import CurveValues
from posefield.motion.skeleton import Skeleton


@dataclass(frozen=True)
class Clip:
    """Frames of a skeleton's motion.

    rotations (F, J, 4): unit quaternions local to the parent. translations (F, J, 3): joint
    translations local to the parent, m; the root's is its path, the others' are the bone offsets.
    rate: frames a second. curves: values of scalar channels; None for a family without them.
    """

    skeleton: Skeleton
    rotations: Rotations
    translations: Positions
    rate: float
    curves: CurveValues | None = None

    def __post_init__(self) -> None:
        frames, joints = len(self.rotations), len(self.skeleton)
        if frames < 1 or self.rotations.shape != (frames, joints, 4):
            raise ValueError(f"rotations {self.rotations.shape}, expected (frames, {joints}, 4)")
        if self.translations.shape != (frames, joints, 3):
            raise ValueError(
                f"translations {self.translations.shape}, expected {frames, joints, 3}"
            )
        if not (np.isfinite(self.rate) and self.rate > 0):
            raise ValueError(f"rate {self.rate}, expected a positive number")
        expected = (frames, len(self.curves.curves)) if self.curves else (frames, 0)
        if self.curve_values.shape != expected:
            raise ValueError(f"curves {self.curve_values.shape}, expected {expected}")

    def __len__(self) -> int:
        return len(self.rotations)

    @property
    def duration(self) -> float:
        """Return the seconds from the first frame to the last."""
        return (len(self) - 1) / self.rate

    @property
    def root_path(self) -> RootPath:
        """Return the root positions (F, 3), m."""
        return self.translations[:, 0]

    @property
    def curve_values(self) -> Annotated[Floats, "frames curves"]:
        """Return the values (F, C) of the curves; (F, 0) without them."""
        return np.zeros((len(self), 0)) if self.curves is None else self.curves.values

    def positions(self) -> Positions:
        """Return the joint positions (F, J, 3) in the character's frame, m."""
        return skeleton.positions(self.skeleton.parents, self.rotations, self.translations)


def assemble(
    joints: Skeleton, rotations: Rotations, root_path: RootPath, bone_offsets: Bones, rate: float
) -> Clip:
    """Return a clip with constant bone offsets (J, 3), m, whose root follows a path (F, 3), m."""
    return Clip(joints, rotations, skeleton.translations(bone_offsets, root_path), rate)
