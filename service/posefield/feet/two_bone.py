"""Inverse kinematics of a limb of two bones, in closed form.

The limb turns about its upper joint towards its target and bends in the plane in which it bent
before (law of cosines). Where the limits of its middle joint are known, this bends about its hinge
alone, within its captured range. Otherwise each bone is turned by the shortest rotation from its
old direction to the new one, so that no axes of joints are assumed. The end keeps its orientation.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.frame_groups import FrameRows
from posefield.common.units import UP, Booleans, Floats, Frames
from posefield.feet.limbs import Limb, LimbPoses, Points, Turns, Values
from posefield.motion import hinges, quat
from posefield.motion.hinges import FREE, Hinge

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


@dataclass(frozen=True)
class LimbTurns:
    """Local rotations (F, 4) of the three joints of a limb, and of bent toes; None where not."""

    upper: Turns
    middle: Turns
    lower: Turns
    tip: Turns | None = None

    def apply(self, limb: Limb, rotations: Annotated[Floats, "frames joints 4"]) -> None:
        """Write the rotations of the limb's joints into poses (F, J, 4)."""
        rotations[..., limb.upper, :] = self.upper
        rotations[..., limb.middle, :] = self.middle
        rotations[..., limb.lower, :] = self.lower
        if self.tip is not None:
            rotations[..., limb.tip, :] = self.tip


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
    return LimbTurns(
        quat.mul(quat.conj(poses.parent_orientation(limb.upper)), thigh),
        quat.mul(quat.conj(thigh), shin),
        quat.mul(quat.conj(shin), poses.orientation(limb.lower)),
    )


def _solve_hinged(poses: LimbPoses, limb: Limb, hinge: Hinge, end: Points) -> LimbTurns:
    """Return rotations as `solve` does, of a limb whose middle joint keeps its limits.

    The middle joint bends about its axis to the wanted distance, and the limb turns about its upper
    joint by the smallest rotation towards the end.
    """
    limits = hinges.one_joint(hinge)
    upper, frame = poses.position(limb.upper), poses.orientation(limb.upper)
    inner = poses.orientation(limb.middle)
    above = quat.rotate(quat.conj(frame), poses.position(limb.middle) - upper)
    below = quat.rotate(quat.conj(inner), poses.position(limb.lower) - poses.position(limb.middle))
    bent = quat.mul(quat.conj(frame), inner)[:, None]
    bent = limits.bend(bent, above, below, np.sum(np.square(end), axis=-1))[:, 0]
    towards = quat.rotate(frame, above + quat.rotate(bent, below))
    thigh = quat.mul(shortest_turn(towards, end), frame)
    shin = quat.mul(thigh, bent)
    return LimbTurns(
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


# The pelvis is lowered this long before and after it is needed, s, and its way is smoothed with a
# Gaussian that is half as wide.
SPREAD, SMOOTHING = 0.06, 0.03
# It is lowered no more than this, m.
MOST = 0.02

Lowering = Annotated[Floats, "frames"]


def need(
    poses: LimbPoses,
    leg: Limb,
    target: Points,
    sunk: float | Annotated[Floats, "_"],
    reach: Values,
) -> Values:
    """Return how much lower a leg needs the pelvis to be (F,), m; infinite out of reach.

    target: of the leg's end (F, 3), m. sunk: by how much the pelvis is lowered already, m. reach:
    distance (F,), m, that the leg spans.
    """
    offset = poses.position(leg.upper) - np.asarray(sunk)[..., None] * UP - target
    level = np.sum(np.square(offset * (1.0 - UP)), axis=-1)
    room = np.square(reach) - level
    highest = np.sqrt(np.maximum(room, 0.0))
    return np.where(room < 0.0, np.inf, np.maximum(offset @ UP - highest, 0.0))


def room(poses: LimbPoses, limb: Limb) -> tuple[Frames, Frames]:
    """Return how far the pelvis may be raised, and lowered (F,), m, for a limb to keep its end."""
    offset = poses.position(limb.upper) - poses.position(limb.lower)
    level = np.sum(np.square(offset * (1.0 - UP)), axis=-1)
    reach = np.sqrt(np.maximum(np.square(firm_reach(poses, limb)) - level, 0.0))
    return np.maximum(reach - offset @ UP, 0.0), np.maximum(reach + offset @ UP, 0.0)


def lower(needs: Sequence[Lowering], limit: Lowering, rows: FrameRows) -> Lowering:
    """Return how much the pelvis is lowered (N,), m: smoothly, by `limit` (N,) at most.

    needs: of each leg (N,), m. rows: of the motions, one after another.
    """
    needed = np.minimum(np.max([np.zeros(limit.shape), *needs], axis=0), limit)
    smooth = cover(needed, rows)
    excess = cover(np.maximum(smooth - limit, 0.0), rows)
    return np.maximum(smooth - excess, 0.0)


def cover(needed: Lowering, rows: FrameRows) -> Lowering:
    """Return smooth paths (N,) that are nowhere below the needed ones, which are not negative.

    The largest value of the neighbourhood, smoothed with a kernel that is no wider than that.
    """
    covered = np.zeros(needed.shape)
    if not needed.any():
        return covered
    halves = np.maximum(1, np.round(SPREAD * rows.rates)).astype(np.int64)
    for half in np.unique(halves).tolist():
        same_size = halves == half
        frames = same_size[rows.groups.group]
        covered[frames] = _covered(needed[frames], rows.select(np.flatnonzero(same_size)), half)
    return covered


def _covered(needed: Lowering, rows: FrameRows, half: int) -> Lowering:
    """Return smooth paths as `cover` does, of rows whose neighbourhoods are of one size."""
    around = range(-half, half + 1)
    kernel = [np.exp(-0.5 * np.square(offset / (SMOOTHING * rows.rates))) for offset in around]
    neighbours = [rows.beside(offset) for offset in around]
    wide = np.max([needed[frames] for frames in neighbours], axis=0)
    smoothed = np.zeros(needed.shape)
    # Not a matrix product, whose sums could go in another order for more motions.
    total = sum(kernel)
    for share, frames in zip(kernel, neighbours, strict=True):
        smoothed += (share / total)[rows.groups.group] * wide[frames]
    return smoothed


def beyond(needed: Values, limit: Values) -> Booleans:
    """Return whether a leg needs more than the pelvis can be lowered (F,)."""
    is_beyond: Booleans = needed > limit + 1e-9
    return is_beyond
