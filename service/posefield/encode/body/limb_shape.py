"""Arms and legs of a person: tubes of rings from the trunk to fingertips and toes."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from posefield.common.units import Floats
from posefield.encode.body.body_plan import UP, Limb, PersonPlan
from posefield.encode.body.bone_chain import BoneChain, ChainPlace
from posefield.encode.body.mesh_builder import MeshBuilder

EVEN = (0.35, 0.75)
"""Shares, for the first two rings, of the change from the trunk's angles to even angles."""


class Ring(NamedTuple):
    """Ring of a limb: its middle, two half axes that are right-handed with the limb, and place."""

    middle: Floats
    first: Floats
    second: Floats
    place: ChainPlace


class Girth(NamedTuple):
    """Girth of a limb: share of the way from one joint to the next, radii and shift, m.

    across, deep: half axes along the person's side and front on a leg, along front and up on an
    arm. shift: of the middle, along deep.
    """

    share: float
    across: float
    deep: float
    shift: float = 0.0


THIGH = (
    Girth(0.24, 0.086, 0.096, 0.002),
    Girth(0.45, 0.077, 0.085, 0.006),
    Girth(0.70, 0.063, 0.070, 0.006),
    Girth(0.90, 0.053, 0.057, 0.004),
)
SEAT = 1.03
"""Width of the ring between trunk and thigh beside the mean of its neighbours."""
SHIN = (
    Girth(0.0, 0.051, 0.055, 0.004),
    Girth(0.10, 0.048, 0.052, 0.000),
    Girth(0.28, 0.051, 0.057, -0.010),
    Girth(0.50, 0.046, 0.050, -0.008),
    Girth(0.76, 0.034, 0.038, -0.004),
)
UPPER_ARM = (
    Girth(0.08, 0.060, 0.060, -0.002),
    Girth(0.26, 0.053, 0.055, -0.004),
    Girth(0.55, 0.045, 0.048, -0.003),
    Girth(0.84, 0.039, 0.041),
)
FOREARM = (
    Girth(0.0, 0.038, 0.039),
    Girth(0.16, 0.041, 0.039),
    Girth(0.40, 0.038, 0.036),
    Girth(0.75, 0.030, 0.027),
)
# Beyond the wrist, as shares of a hand's length: a mitten, wide along the front.
HAND_LENGTH = 0.185
HAND = (
    Girth(0.0, 0.028, 0.021),
    Girth(0.20, 0.038, 0.020),
    Girth(0.46, 0.045, 0.018),
    Girth(0.74, 0.041, 0.015),
    Girth(0.95, 0.031, 0.011),
)
# Beside ankle, toe joint and toe tip, m: how far ahead and up the sole's and the instep's point of
# each ring lies, and half its width. None stands for the height of the sole.
ANKLE = (
    ((-0.040, 0.045), (0.040, 0.055), 0.036),
    ((-0.050, 0.000), (0.056, 0.028), 0.036),
    ((-0.050, None), (0.080, 0.004), 0.036),
)
SOLE, TIP, ANKLE_HEIGHT = 0.024, 0.002, 0.075
"""Heights above the sole, m: of the toe joint and of its tip at least, else of the ankle."""
THUMB = ((0.012, 0.014), (0.034, 0.012), (0.052, 0.008))
"""Distance from the hand and radius of each ring of a thumb, m."""


def build_leg(mesh: MeshBuilder, plan: PersonPlan, leg: Limb, loop: Sequence[int]) -> None:
    """Add a leg with a foot that stands flat, welded to points of the trunk."""
    rings = [*_rings(leg, (leg.root, leg.middle), THIGH, plan.side, plan.scale)]
    rings += _rings(leg, (leg.middle, leg.end), SHIN, plan.side, plan.scale)
    sole = sole_height(plan, leg)
    rings += _foot(plan, leg, sole)
    tip = rings[-1].middle + 0.012 * plan.scale * plan.front
    _tube(mesh, leg.chain, _hip_ring(mesh, leg, loop, rings[0]), rings, tip, floor=sole)


def build_arm(mesh: MeshBuilder, plan: PersonPlan, arm: Limb, loop: Sequence[int]) -> None:
    """Add an arm with a mitten and a thumb, welded to points of the trunk."""
    rings = [*_rings(arm, (arm.root, arm.middle), UPPER_ARM, plan.front, plan.scale)]
    rings += _rings(arm, (arm.middle, arm.end), FOREARM, plan.front, plan.scale)
    hand = list(_hand(plan, arm))
    tip = hand[-1].middle + 0.06 * (hand[-1].middle - hand[0].middle)
    made = _tube(mesh, arm.chain, loop, [*rings, *hand], tip)
    palm, knuckles = made[-4], made[-3]
    _thumb(mesh, plan, arm, (palm, knuckles))


def _hip_ring(mesh: MeshBuilder, leg: Limb, loop: Sequence[int], below: Ring) -> list[int]:
    """Return a ring half-way from the slanted edge of the trunk to the first ring of a leg."""
    start = np.array([mesh.points[point] for point in loop])
    half = 0.5 * (start + _around(below, _angles(start, below)))
    centre = half.mean(axis=0)
    mark = 0.5 * (leg.chain.marks[leg.root] + _mark(leg.chain, below.place))
    made = mesh.add_ring(centre + SEAT * (half - centre), leg.chain, leg.chain.at(mark))
    mesh.join(loop, made)
    return made


def sole_height(plan: PersonPlan, leg: Limb) -> float:
    """Return the height of the sole of a foot at rest, m."""
    heights = leg.chain.points[:, 1]
    joints = heights[leg.end + 1 : len(heights) - leg.chain.tipped]
    known = [float(height) - plan.scale * SOLE for height in joints]
    if leg.chain.tipped:
        known.append(float(heights[-1]) - plan.scale * TIP)
    return min(known, default=float(heights[leg.end]) - plan.scale * ANKLE_HEIGHT)


def _rings(
    limb: Limb, ends: tuple[int, int], girths: Sequence[Girth], wide: Floats, scale: float
) -> Iterator[Ring]:
    """Yield rings between two points of a limb."""
    marks = limb.chain.marks
    start, end = limb.point(ends[0]), limb.point(ends[1])
    for girth in girths:
        along = _unit(end - start)
        if girth.share == 0.0:
            along = _unit(along + _unit(start - limb.point(ends[0] - 1)))
        first, second = _axes(along, wide)
        middle = start + girth.share * (end - start) + scale * girth.shift * second
        mark = marks[ends[0]] + girth.share * (marks[ends[1]] - marks[ends[0]])
        place = limb.chain.at(float(mark))
        yield Ring(middle, scale * girth.across * first, scale * girth.deep * second, place)


def _hand(plan: PersonPlan, arm: Limb) -> Iterator[Ring]:
    """Yield the rings of a mitten that reaches at least to the end of the longest finger."""
    wrist, marks = arm.point(arm.end), arm.chain.marks
    bones = arm.chain.points[arm.end :]
    along = _unit(bones[-1] - wrist) if len(bones) > 1 else _unit(wrist - arm.point(arm.end - 1))
    reach = float((bones[-1] - wrist) @ along) + plan.scale * 0.02
    long = max(plan.scale * HAND_LENGTH, reach)
    first, second = _axes(along, plan.front)
    for girth in HAND:
        place = arm.chain.at(float(marks[arm.end]) + girth.share * long)
        middle = wrist + girth.share * long * along
        yield Ring(
            middle, plan.scale * girth.across * first, plan.scale * girth.deep * second, place
        )


def _foot(plan: PersonPlan, leg: Limb, sole: float) -> Iterator[Ring]:
    """Yield rings from above the ankle around the heel to the toes."""
    ankle, scale = leg.point(leg.end), plan.scale
    toes = leg.chain.points[leg.end + 1 :]
    for low, high, wide in ANKLE:
        yield _standing(plan, leg, ankle, (low, high), wide, sole)
    ball = toes[0] if len(toes) else ankle + scale * (0.13 * plan.front - 0.05 * UP)
    arch = 0.5 * (ankle + ball)
    arch[1] = sole
    ahead = float((ball - ankle) @ plan.front) / scale
    yield _standing(plan, leg, arch, ((0.0, None), (0.5 * ahead - 0.045, 0.068)), 0.038, sole)
    tip = toes[-1] if len(toes) > 1 else ball + scale * 0.06 * plan.front
    forth = max(0.05, float((tip - ball) @ plan.front) / scale)
    ball = np.array([ball[0], sole, ball[2]])
    yield _standing(plan, leg, ball, ((-0.012, None), (-0.012, 0.050)), 0.046, sole)
    yield _standing(plan, leg, ball, ((0.55 * forth, None), (0.55 * forth, 0.038)), 0.046, sole)
    yield _standing(plan, leg, ball, ((forth + 0.004, None), (forth, 0.026)), 0.034, sole)


def _standing(
    plan: PersonPlan,
    leg: Limb,
    middle: Floats,
    ends: tuple[tuple[float, float | None], tuple[float, float]],
    wide: float,
    sole: float,
) -> Ring:
    """Return a ring of a foot between a point below and a point above."""
    (back, low), (ahead, high) = ends
    scale = plan.scale
    below = middle + scale * (back * plan.front + (low or 0.0) * UP)
    if low is None:
        # The lowest points are pressed flat, so that a sole is as wide as a foot.
        below[1] = sole - 0.010 * scale
    above = middle + scale * (ahead * plan.front + high * UP)
    centre = 0.5 * (below + above)
    return Ring(centre, scale * wide * plan.side, 0.5 * (above - below), leg.chain.nearest(centre))


def _tube(
    mesh: MeshBuilder,
    chain: BoneChain,
    loop: Sequence[int],
    rings: Sequence[Ring],
    tip: Floats,
    floor: float | None = None,
) -> list[list[int]]:
    """Return the rings of a tube from a loop of points on, closed by a tip."""
    start = np.array([mesh.points[point] for point in loop])
    given = _angles(start, rings[0])
    count = len(loop)
    steps = 2.0 * np.pi * np.arange(count) / count
    even = steps + (given - steps).mean()
    made, before = [], list(loop)
    for index, ring in enumerate(rings):
        share = EVEN[index] if index < len(EVEN) else 1.0
        angles = (1.0 - share) * given + share * even
        points = _around(ring, angles)
        if floor is not None:
            points[:, 1] = np.maximum(points[:, 1], floor)
        made.append(mesh.add_ring(points, chain, ring.place))
        mesh.join(before, made[-1])
        before = made[-1]
    if floor is not None:
        tip = np.array([tip[0], max(tip[1], floor), tip[2]])
    mesh.close(before, mesh.add(tip, chain, rings[-1].place))
    return made


def _thumb(
    mesh: MeshBuilder, plan: PersonPlan, arm: Limb, rows: tuple[list[int], list[int]]
) -> None:
    """Add a thumb in place of the face of the palm that looks ahead most."""
    low, high = rows
    faces = [
        (low[i], low[(i + 1) % len(low)], high[(i + 1) % len(low)], high[i])
        for i in range(len(low))
    ]
    face = max(faces, key=lambda f: float(sum(mesh.points[p] for p in f) @ plan.front))
    mesh.faces.remove(face)
    corners = np.array([mesh.points[point] for point in face])
    along = _unit(arm.point(arm.end) - arm.point(arm.end - 1))
    out = _unit(plan.front - (plan.front @ along) * along + 0.8 * along)
    first, second = _axes(out, along)
    place = mesh.places[face[0]]
    middle = corners.mean(axis=0)
    rings = [
        Ring(
            middle + plan.scale * far * out, plan.scale * r * first, plan.scale * r * second, place
        )
        for far, r in THUMB
    ]
    _tube(mesh, arm.chain, face, rings, rings[-1].middle + 0.006 * plan.scale * out)


def _around(ring: Ring, angles: Floats) -> Floats:
    """Return the points (N, 3) of a ring at angles (N,)."""
    first, second = np.cos(angles)[:, None] * ring.first, np.sin(angles)[:, None] * ring.second
    points: Floats = ring.middle + first + second
    return points


def _mark(chain: BoneChain, place: ChainPlace) -> float:
    """Return the distance of a place from the start of its chain, m."""
    marks = chain.marks
    step = marks[place.segment + 1] - marks[place.segment]
    return float(marks[place.segment] + place.share * step)


def _angles(points: Floats, ring: Ring) -> Floats:
    """Return the angles (N,) of points about a ring, increasing."""
    off = points - points.mean(axis=0)
    x, y = off @ _unit(ring.first), off @ _unit(ring.second)
    found: Floats = np.unwrap(np.arctan2(y, x))
    return found


def _axes(along: Floats, wide: Floats) -> tuple[Floats, Floats]:
    """Return two unit vectors across a limb, the first as near to `wide` as may be."""
    first = _unit(wide - (wide @ along) * along)
    return first, np.cross(along, first)


def _unit(vector: Floats) -> Floats:
    length = np.linalg.norm(vector)
    found: Floats = vector / (length if length > 0 else 1.0)
    return found
