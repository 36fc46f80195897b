"""Limbs of two bones, found in a skeleton, and the positions of their joints."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np

from posefield.common import frame_groups
from posefield.common.frame_groups import FrameGroups
from posefield.common.units import Bones, Floats
from posefield.motion import skeleton
from posefield.motion.hinges import Hinge

Points = Annotated[Floats, "frames 3"]
Turns = Annotated[Floats, "frames 4"]
Values = Annotated[Floats, "frames"]


@dataclass(frozen=True)
class Limb:
    """Joints of a limb: hip, knee, ankle and ball of a leg, or shoulder, elbow, wrist and tip.

    upper, middle, lower: indices; each is the parent of the next. tip: the joint that is placed;
    `lower`, or a descendant of it that moves with it. hinge: limits of the middle joint; None where
    they are unknown. toe: from the tip to the end of the toes, m; None where that is unknown.
    """

    upper: int
    middle: int
    lower: int
    tip: int
    hinge: Hinge | None = None
    toe: tuple[float, float, float] | None = None


@dataclass(frozen=True)
class LimbPoses:
    """Some limbs of one character in F poses.

    parents: of the compact skeleton. joints: of the whole skeleton, by compact joint. bones:
    offsets (C, 3), m. positions: (F, C, 3), m. orientations: (F, C, 4). groups: of the frames of
    several motions, whose bones are (M, C, 3); None for the frames of one motion.
    """

    joints: tuple[int, ...]
    parents: tuple[int, ...]
    bones: Annotated[Floats, "*motions chain 3"]
    positions: Annotated[Floats, "frames chain 3"]
    orientations: Annotated[Floats, "frames chain 4"]
    groups: FrameGroups | None = None

    @cached_property
    def _places(self) -> dict[int, int]:
        return {joint: index for index, joint in enumerate(self.joints)}

    def position(self, joint: int) -> Points:
        """Return the positions (F, 3), m, of a joint of the whole skeleton."""
        return self.positions[..., self._places[joint], :]

    def orientation(self, joint: int) -> Turns:
        """Return the orientations (F, 4) of a joint of the whole skeleton."""
        return self.orientations[..., self._places[joint], :]

    def parent_orientation(self, joint: int) -> Turns:
        """Return the orientations (F, 4) of a joint's parent."""
        return self.orientations[..., self.parents[self._places[joint]], :]

    def length(self, joint: int) -> Annotated[Floats, "_"]:
        """Return the length (1,) of the bone that ends at a joint, m; (F,) for groups."""
        lengths: Floats = np.linalg.norm(self.bones[..., self._places[joint], :], axis=-1)
        return lengths[..., None] if self.groups is None else lengths[self.groups.group]

    def split(self) -> "list[LimbPoses]":
        """Return the poses of each motion of the groups."""
        assert self.groups is not None
        motions = zip(
            self.bones,
            self.groups.split(self.positions),
            self.groups.split(self.orientations),
            strict=True,
        )
        return [LimbPoses(self.joints, self.parents, *motion) for motion in motions]

    def mean(self, values: Points) -> Annotated[Floats, "_ 3"]:
        """Return the mean (1, 3) of values (F, 3) over a motion; (F, 3) for groups."""
        if self.groups is None:
            return np.asarray(np.mean(values, axis=-2, keepdims=True))
        return self.groups.means(values)[self.groups.group]


def find_limb(
    parents: Sequence[int], bones: Bones, tip: int, hinges: Sequence[Hinge] = ()
) -> Limb | None:
    """Return the limb that ends at a joint; None if the chain above it has no two bones.

    The limb's end is the joint or its parent, as the ball of a foot has an ankle above it: the one
    whose two bones have lengths that are more alike. A limb does not begin at the root, whose
    rotation would turn the whole character. hinges: of the skeleton, as far as known.
    """
    hinge_of = {hinge.joint: hinge for hinge in hinges}
    chain = skeleton.joint_chain(tuple(parents), tip)[::-1]
    # The ankle is the tip's parent, or the tip itself. The joint above the hip exists in both.
    candidates = [
        Limb(chain[first + 2], chain[first + 1], chain[first], tip, hinge_of.get(chain[first + 1]))
        for first in (1, 0)
        if len(chain) > first + 3
    ]
    scores = []
    for limb in candidates:
        lengths = [math.hypot(*bones[joint].tolist()) for joint in (limb.middle, limb.lower)]
        # The shorter bone over the longer one; a known knee or elbow comes first.
        score = min(lengths) / max(lengths) if max(lengths) > 0.0 else 0.0
        scores.append(score + (limb.hinge is not None))
    return candidates[int(np.argmax(scores))] if max(scores, default=0.0) > 0.0 else None


def find_kept_limb(
    parents: Sequence[int], bones: Bones, joint: int, hinges: Sequence[Hinge] = ()
) -> Limb | None:
    """Return the limb by which a joint can be moved alone; None for a joint of the trunk.

    Less than half of the joints hang from such a limb.
    """
    limb = find_limb(parents, bones, joint, hinges)
    if limb is None:
        return None
    below = skeleton.descendant_matrix(tuple(parents))[limb.upper].sum()
    return limb if 2 * below < len(parents) else None


def evaluate_motions(
    parents: Sequence[int],
    bones: Annotated[Floats, "motions joints 3"],
    limbs: Sequence[Limb],
    rotations: Annotated[Floats, "frames joints 4"],
    roots: Annotated[Floats, "frames 3"],
    groups: FrameGroups,
) -> LimbPoses:
    """Return the poses of the limbs of several motions, one after another; bones (M, J, 3), m."""
    joints, compact_parents = _compact(parents, [limb.tip for limb in limbs])
    arms = bones[:, list(joints)]
    translations = arms[groups.group]
    translations[:, 0] = roots
    evaluated = skeleton.forward_kinematics(
        compact_parents, rotations[:, list(joints)], translations
    )
    return LimbPoses(joints, compact_parents, arms, *evaluated, groups)


def join(motions: Sequence[LimbPoses]) -> LimbPoses:
    """Return the poses of the same limbs in several motions, each without groups, as groups."""
    first = motions[0]
    return LimbPoses(
        first.joints,
        first.parents,
        np.stack([motion.bones for motion in motions]),
        np.concatenate([motion.positions for motion in motions]),
        np.concatenate([motion.orientations for motion in motions]),
        frame_groups.of_lengths([motion.positions for motion in motions]),
    )


def evaluate_joints(
    parents: Sequence[int],
    bones: Annotated[Floats, "joints 3"],
    tips: Sequence[int],
    rotations: Annotated[Floats, "frames joints 4"],
    roots: Points,
) -> LimbPoses:
    """Return the poses of joints and of those above them.

    bones: (J, 3), m. rotations: (F, J, 4). roots: (F, 3), m.
    """
    joints, compact_parents = _compact(parents, tips)
    arms = bones[..., list(joints), :]
    translations = skeleton.translations(arms, roots)
    evaluated = skeleton.forward_kinematics(
        compact_parents, rotations[..., list(joints), :], translations
    )
    return LimbPoses(joints, compact_parents, arms, *evaluated)


def _compact(
    parents: Sequence[int], tips: Sequence[int]
) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return joints with those above them, in order, and the place of each one's parent."""
    needed = {0}
    for joint in tips:
        needed.update(skeleton.joint_chain(tuple(parents), joint))
    joints = tuple(sorted(needed))
    indices = {joint: index for index, joint in enumerate(joints)}
    return joints, tuple(indices.get(parents[joint], -1) for joint in joints)
