"""Clips and crowds: motions of one skeleton, sampled at a constant rate."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated, Any

import numpy as np

from posefield.common.units import (
    UP,
    Bones,
    Booleans,
    Floats,
    Indices,
    PerCharacter,
    Positions,
    RootPath,
    Rotations,
    Singles,
)
from posefield.motion import quat, skeleton
from posefield.motion.curves import CurveValues
from posefield.motion.skeleton import Skeleton


@dataclass(frozen=True)
class Clip:
    """Frames of a skeleton's motion.

    rotations (F, J, 4): unit quaternions local to the parent. translations (F, J, 3): joint
    translations local to the parent, m; the root's is its path, the others' are the bone offsets.
    rate: frames a second. curves: values of scalar channels; None for a family without them.
    root_bone: whether files have a joint on the floor above the hips (`root_bone`). roles: joints,
    by index, of the roles that the model's recipe gives.
    """

    skeleton: Skeleton = field(repr=False)
    rotations: Rotations = field(repr=False)
    translations: Positions = field(repr=False)
    rate: float
    curves: CurveValues | None = field(default=None, repr=False)
    root_bone: bool = False
    roles: Mapping[str, int] = field(default_factory=dict, repr=False)

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

    def part(self, frames: slice | Sequence[int]) -> "Clip":
        """Return some of the frames."""
        curves = self.curves and replace(self.curves, values=self.curves.values[frames])
        rotations, translations = self.rotations[frames], self.translations[frames]
        return replace(self, rotations=rotations, translations=translations, curves=curves)

    def positions(self) -> Positions:
        """Return the joint positions (F, J, 3) in the character's frame, m."""
        return skeleton.positions(self.skeleton.parents, self.rotations, self.translations)


def assemble(
    joints: Skeleton, rotations: Rotations, root_path: RootPath, bone_offsets: Bones, rate: float
) -> Clip:
    """Return a clip with constant bone offsets (J, 3), m, whose root follows a path (F, 3), m."""
    return Clip(joints, rotations, skeleton.translations(bone_offsets, root_path), rate)


@dataclass(frozen=True)
class Placement:
    """Positions and headings of the characters' own frames in the world.

    positions: (N, 3), m. headings: (N,), rad. A heading turns the frame about +Y: a character that
    faces +Z in its own frame faces +X at a heading of a quarter turn.
    """

    positions: Annotated[Floats, "characters 3"]
    headings: PerCharacter

    def __len__(self) -> int:
        return len(self.headings)

    def select(self, indices: Annotated[Indices, "chosen"]) -> "Placement":
        """Return the placement of the characters of some indices (M,)."""
        return Placement(self.positions[indices], self.headings[indices])

    @property
    def turns(self) -> Annotated[Floats, "characters 4"]:
        """Return the quaternions (N, 4) of the headings."""
        return quat.from_axis_angle(UP, self.headings)


@dataclass(frozen=True)
class StandingFeet:
    """Facts about the feet of M motions that were made to stand: a number (M,) for each motion.

    skate_before, skate: mean foot skate of the prediction and of the motion, m/s. drift: largest
    distance of a standing foot from its place, m. lowered: largest distance by which the pelvis was
    lowered so that the legs reach, m.
    """

    skate_before: Annotated[Floats, "motions"]
    skate: Annotated[Floats, "motions"]
    drift: Annotated[Floats, "motions"]
    lowered: Annotated[Floats, "motions"]


@dataclass(frozen=True)
class Motions:
    """Motions of equal length, each in its character's own frame.

    rotations: (M, F, J, 4). root_position: (M, F, 3), m. bone_offsets: (M, J, 3), m. levels (M, F):
    level of detail at which each pose was computed. curves: values (M, F, C) of the crowd's curves;
    None without them. feet: None where they are as predicted.
    """

    rotations: Annotated[Singles, "motions frames joints 4"]
    root_position: Annotated[Singles, "motions frames 3"]
    bone_offsets: Annotated[Singles, "motions joints 3"]
    levels: Annotated[Indices, "motions frames"]
    curves: Annotated[Singles, "motions frames curves"] | None = None
    feet: StandingFeet | None = None

    def __len__(self) -> int:
        return len(self.rotations)


@dataclass(frozen=True)
class CrowdPoses:
    """One pose of each of N characters, placed in the world.

    model: name@contenthash. rotations (N, J, 4): local to the parent, the root's in the world.
    root_position (N, 3): in the world, m. bone_offsets: (N, J, 3), m. levels (N,): level of detail
    of each character. error_px (N,): projected error of the level, pixels; None without a camera.
    duration (N,): of each character's clip, s. sigma (N,), m, and supported (N,): as in Trust.
    warnings: sentences about the crowd as a whole. curves: values (N, C) of the curves with names
    curve_names; None for a model without them.
    """

    model: str
    skeleton: Skeleton
    rotations: Annotated[Singles, "characters joints 4"]
    root_position: Annotated[Singles, "characters 3"]
    bone_offsets: Annotated[Singles, "characters joints 3"]
    levels: Annotated[Indices, "characters"]
    error_px: Annotated[Singles, "characters"] | None
    duration: Annotated[Singles, "characters"]
    sigma: Annotated[Singles, "characters"]
    supported: Annotated[Booleans, "characters"]
    warnings: tuple[str, ...]
    curve_names: tuple[str, ...] = ()
    curves: Annotated[Singles, "characters curves"] | None = None

    def __len__(self) -> int:
        return len(self.rotations)


@dataclass(frozen=True)
class CrowdClip:
    """Moving crowd: N characters that play M motions of equal length.

    frames: of each motion. rate: frames a second. motion (N,): index of the motion that each
    character plays. batches: the motions in order, several at a time, computed lazily to bound
    memory; they can be iterated once. facts: provenance as plain values. curves: names of the
    motions' curves; empty where they have none. presence: the first frame in which each character
    is there, and the one after the last (N, 2); None where all are there all the time.
    """

    skeleton: Skeleton
    rate: float
    frames: int
    placement: Placement
    motion: Annotated[Indices, "characters"]
    batches: Iterable[Motions]
    facts: Mapping[str, Any]
    curves: tuple[str, ...] = ()
    presence: Annotated[Indices, "characters 2"] | None = None

    @property
    def shared(self) -> bool:
        """Return whether any motion is played by more than one character."""
        return len(np.unique(self.motion)) < len(self.motion)
