"""Limbs of two bones: choose them in a skeleton, and turn them so that their ends reach targets.

A limb turns about its upper joint towards its target and bends in the plane in which it bent before
(law of cosines). Where the limits of its middle joint are known, this bends about its hinge alone,
within its captured range. Otherwise each bone is turned by the shortest rotation from its old
direction to the new one, so that no axes of joints are assumed. The end keeps its orientation.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common import frame_groups
from posefield.common.frame_groups import FrameGroups
from posefield.common.units import UP, Bones, Floats, Frames
from posefield.motion import hinges, quat, skeleton
from posefield.motion.hinges import FREE, Hinge

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

    def position(self, joint: int) -> Points:
        """Return the positions (F, 3), m, of a joint of the whole skeleton."""
        return self.positions[..., self.joints.index(joint), :]

    def orientation(self, joint: int) -> Turns:
        """Return the orientations (F, 4) of a joint of the whole skeleton."""
        return self.orientations[..., self.joints.index(joint), :]

    def parent_orientation(self, joint: int) -> Turns:
        """Return the orientations (F, 4) of a joint's parent."""
        return self.orientations[..., self.parents[self.joints.index(joint)], :]

    def bone(self, joint: int) -> Annotated[Floats, "_ 3"]:
        """Return the bone (1, 3) that ends at a joint, m; (F, 3) for groups.

        It is in the frame of the joint's parent, which turns it.
        """
        bones: Floats = self.bones[..., self.joints.index(joint), :]
        return bones[None] if self.groups is None else bones[self.groups.group]

    def length(self, joint: int) -> Annotated[Floats, "_"]:
        """Return the length (1,) of the bone that ends at a joint, m; (F,) for groups."""
        return np.asarray(np.linalg.norm(self.bone(joint), axis=-1))

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
    rotations: Sequence[Annotated[Floats, "_ joints 4"]],
    roots: Annotated[Floats, "frames 3"],
    groups: FrameGroups,
) -> LimbPoses:
    """Return the poses of the limbs of several motions, one after another; bones (M, J, 3), m."""
    joints, compact_parents = _compact(parents, [limb.tip for limb in limbs])
    chain = list(joints)
    arms = bones[:, chain]
    translations = arms[groups.group]
    translations[:, 0] = roots
    turns = np.concatenate([motion[:, chain] for motion in rotations])
    evaluated = skeleton.forward_kinematics(compact_parents, turns, translations)
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


# A limb is not stretched beyond this share of its length; from 5 mm before it on it resists.
REACH, SOFTNESS = 0.995, 0.005
# A leg is no straighter than this share of its length, but as far as it is predicted: 178 degrees.
STRAIGHT = 0.9998
# The heel of a straight leg presses by this much before the leg bends, m.
PRESS = 0.005
# Share of the limb's length by which it bends at least, where its plane is taken from its bend.
LEAST_BEND = 0.01
# Share of the limb's length up to which a leg that bends backwards is taken as straight; one that
# bends twice as far bends on so.
OVERSTRETCHED = 0.1
# Distance between the ends of a limb, as a share of its length, up to which it is folded: its
# middle stays towards where it was. From twice the distance on it bends in its plane alone.
FOLDED = 0.2
# Share of the upper bone that must be across the new direction for that.
LEAST_ACROSS = 0.3

LimbTurns = tuple[Turns, Turns, Turns]
"""Local rotations (F, 4) of the three joints of a limb, from the upper one."""


def firm_reach(poses: LimbPoses, limb: Limb) -> Values:
    """Return the distance (F,), m, up to which the end of a limb follows its target exactly."""
    _, length = distances(poses, limb)
    source = np.linalg.norm(poses.position(limb.lower) - poses.position(limb.upper), axis=-1)
    reach: Values = np.maximum(source, REACH * length - SOFTNESS)
    return reach


def distances(poses: LimbPoses, limb: Limb) -> tuple[Values, Values]:
    """Return the smallest and the largest distance of a limb's ends, m: (1,), or (F,) for groups.

    The middle joint is within the captured range of its hinge; without one, it bends by any angle.
    """
    above, below = poses.length(limb.middle), poses.length(limb.lower)
    if limb.hinge is None:
        return np.abs(above - below), above + below
    squares, products = np.square(above) + np.square(below), 2.0 * above * below
    bends = np.clip([limb.hinge.high[0] + FREE, limb.hinge.low[0] - FREE], 0.0, np.pi)
    shortest, longest = (np.sqrt(squares + np.cos(bend) * products) for bend in bends)
    return shortest, longest


def soften(
    distance: Values,
    firm: Values,
    length: float | Annotated[Floats, "_"] | Annotated[Floats, "_"],
) -> Values:
    """Return distances (F,), m, that exceed the firm reach softly, and never the length.

    Beyond a they are a + s (1 - exp(-(d - a) / s)), where s is at most 5 mm.
    """
    soft = np.maximum(np.maximum(REACH * length, firm) - firm, 1e-9)
    beyond = np.maximum(distance - firm, 0.0)
    softened: Values = np.minimum(distance, firm + soft * -np.expm1(-beyond / soft))
    return softened


def leg_chord(poses: LimbPoses, leg: Limb, distance: Values) -> Values:
    """Return distances (F,), m, that a leg spans where it is wanted to span some.

    A bent leg spans what is wanted. One that is predicted straight hardly becomes longer: its knee
    would move several times as fast as its foot, which lifts its heel instead. A change x becomes
    x / sqrt(1 + (x / w)²), where w is the room that the predicted leg has. Nor does it become
    shorter at once: its heel presses first, by p tanh(x / p). Legs without a foot follow as far as
    their firm reach.
    """
    shortest, longest = distances(poses, leg)
    if leg.tip == leg.lower:
        chord = soften(distance, firm_reach(poses, leg), longest)
    else:
        source = np.linalg.norm(poses.position(leg.lower) - poses.position(leg.upper), axis=-1)
        more, room = distance - source, np.maximum(STRAIGHT * longest - source, 1e-4)
        chord = source + more / np.sqrt(1.0 + np.square(np.maximum(more, 0.0) / room))
        press = PRESS / (1.0 + np.square(room / PRESS))
        chord += press * np.tanh(np.maximum(-more, 0.0) / press)
    return np.asarray(np.maximum(chord, 1.001 * shortest + 1e-6))


def reach(poses: LimbPoses, limb: Limb, shift: Points, target: Points) -> Points:
    """Return the vectors (F, 3), m, from the upper joint of a limb to where its end comes.

    shift: movement (F, 3), m, of the upper joint from its place in the poses. target: (F,
    3), m; it is approached along its direction if it is out of reach.
    """
    shortest, longest = distances(poses, limb)
    offset = target - poses.position(limb.upper) - shift
    distance = np.linalg.norm(offset, axis=-1)
    soft = soften(distance, firm_reach(poses, limb), longest)
    within = np.maximum(soft, 1.001 * shortest + 1e-6)
    end: Points = offset * (within / np.maximum(distance, 1e-9))[..., None]
    return end


def solve(poses: LimbPoses, limb: Limb, end: Points) -> LimbTurns:
    """Return the rotations with which the end of a limb comes where it is wanted.

    end: vectors (F, 3), m, from the limb's upper joint. The end's orientation is kept.
    """
    if limb.hinge:
        return _solve_hinged(poses, limb, limb.hinge, end)
    above, below = poses.length(limb.middle), poses.length(limb.lower)
    upper, middle = poses.position(limb.upper), poses.position(limb.middle)
    lower = poses.position(limb.lower)
    distance = np.linalg.norm(end, axis=-1)
    towards = end / distance[..., None]
    side = _bend_direction(poses, limb, towards)
    along = (np.square(above) + np.square(distance) - np.square(below)) / (2.0 * distance)
    across = np.sqrt(np.maximum(np.square(above) - np.square(along), 0.0))
    knee = along[..., None] * towards + across[..., None] * side
    thigh = quat.mul(shortest_turn(middle - upper, knee), poses.orientation(limb.upper))
    shin = quat.mul(shortest_turn(lower - middle, end - knee), poses.orientation(limb.middle))
    return (
        quat.mul(quat.conj(poses.parent_orientation(limb.upper)), thigh),
        quat.mul(quat.conj(thigh), shin),
        quat.mul(quat.conj(shin), poses.orientation(limb.lower)),
    )


def _solve_hinged(poses: LimbPoses, limb: Limb, hinge: Hinge, end: Points) -> LimbTurns:
    """Return rotations as `solve` does, of a limb whose middle joint keeps its limits.

    The middle joint bends about its axis to the wanted distance, and the limb turns about its upper
    joint by the smallest rotation towards the end.
    """
    limits, frame = hinges.one_joint(hinge), poses.orientation(limb.upper)
    above, below = poses.bone(limb.middle), poses.bone(limb.lower)
    bent = quat.mul(quat.conj(frame), poses.orientation(limb.middle))[:, None]
    bent = limits.bend(bent, above, below, np.sum(np.square(end), axis=-1))[:, 0]
    towards = quat.rotate(frame, above + quat.rotate(bent, below))
    thigh = quat.mul(shortest_turn(towards, end), frame)
    shin = quat.mul(thigh, bent)
    return (
        quat.mul(quat.conj(poses.parent_orientation(limb.upper)), thigh),
        bent,
        quat.mul(quat.conj(shin), poses.orientation(limb.lower)),
    )


def shortest_turn(
    before: Annotated[Floats, "*batch 3"], after: Annotated[Floats, "*batch 3"]
) -> Annotated[Floats, "*batch 4"]:
    """Return the rotation (..., 4) by the smallest angle from one direction to another."""
    sizes = np.linalg.norm(before, axis=-1) * np.linalg.norm(after, axis=-1)
    real = np.maximum(sizes + np.sum(before * after, axis=-1), 1e-12)
    return quat.normalize(np.concatenate([real[..., None], quat.cross(before, after)], axis=-1))


def _bend_direction(poses: LimbPoses, limb: Limb, towards: Points) -> Points:
    """Return the unit vectors (F, 3), orthogonal to the limb, towards which its middle bends.

    Where a limb is nearly straight its plane is that of its mean bend, about one axis of its upper
    bone, as that of a knee; so is that of a leg that bends a little the other way.
    """
    upper, middle = poses.position(limb.upper), poses.position(limb.middle)
    chord = poses.position(limb.lower) - upper
    old = chord / np.maximum(np.linalg.norm(chord, axis=-1, keepdims=True), 1e-9)
    bone = middle - upper
    bend = bone - np.sum(bone * old, axis=-1, keepdims=True) * old
    frame = poses.orientation(limb.upper)
    mean = poses.mean(quat.rotate(quat.conj(frame), quat.cross(bone, old)))
    size = np.linalg.norm(mean, axis=-1, keepdims=True)
    smallest_bend = LEAST_BEND * poses.length(limb.middle)[..., None]
    axis = quat.rotate(frame, np.broadcast_to(mean / np.maximum(size, 1e-9), bend.shape))
    mean_side = quat.cross(old, axis)
    bent = np.linalg.norm(bend, axis=-1)
    if limb.tip != limb.lower:
        # A knee that is a little overstretched would bend backwards where its leg is shortened.
        little = np.clip(2.0 - bent / (OVERSTRETCHED * poses.length(limb.middle)), 0.0, 1.0)
        bent = bent + little * (np.sum(bend * mean_side, axis=-1) - bent)
    mixed = bend + np.maximum(smallest_bend - bent[..., None], 0.0) * mean_side
    side = quat.rotate(shortest_turn(old, towards), mixed)
    side = _towards_middle(side, chord, bone, towards)
    side = side - np.sum(side * towards, axis=-1, keepdims=True) * towards
    direction: Points = side / np.maximum(np.linalg.norm(side, axis=-1, keepdims=True), 1e-12)
    return direction


def _towards_middle(side: Points, chord: Points, bone: Points, towards: Points) -> Points:
    """Return the vectors (F, 3) towards which a limb bends, where it is folded to its middle.

    The ends of a folded limb are so near each other that their direction turns by any angle in a
    frame, and its plane with it; its middle moves as the limb does. bone: to it (F, 3), m.
    """
    size = np.linalg.norm(bone, axis=-1, keepdims=True)
    distance = np.linalg.norm(chord, axis=-1, keepdims=True)
    # The distance is compared with the bone, about half of the limb.
    folded = np.clip(2.0 - distance / (2.0 * FOLDED * size), 0.0, 1.0)
    across = (bone - np.sum(bone * towards, axis=-1, keepdims=True) * towards) / size
    much = np.linalg.norm(across, axis=-1, keepdims=True)
    folded = folded * np.clip(much / LEAST_ACROSS, 0.0, 1.0)
    scale = np.linalg.norm(side, axis=-1, keepdims=True) / np.maximum(much, 1e-9)
    direction: Points = side + folded * (scale * across - side)
    return direction


def room(poses: LimbPoses, limb: Limb) -> tuple[Frames, Frames]:
    """Return how far the pelvis may be raised, and lowered (F,), m, for a limb to keep its end."""
    offset = poses.position(limb.upper) - poses.position(limb.lower)
    level = np.sum(np.square(offset * (1.0 - UP)), axis=-1)
    reach = np.sqrt(np.maximum(np.square(firm_reach(poses, limb)) - level, 0.0))
    return np.maximum(reach - offset @ UP, 0.0), np.maximum(reach + offset @ UP, 0.0)
