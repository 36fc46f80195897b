"""Trunk, neck and head of a person as rings of points from the hips to the crown."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from posefield.common.units import Floats
from posefield.encode.body import bone_chain
from posefield.encode.body.body_plan import UP, PersonPlan
from posefield.encode.body.bone_chain import BoneChain
from posefield.encode.body.mesh_builder import MeshBuilder

COLUMNS = 16
"""Points of a ring: the first on the left, then by the back, the right and the front."""
LEFT, BACK, RIGHT, FRONT = 0, 4, 8, 12


class RingShape(NamedTuple):
    """Ring of a person of scale 1, m: its height, and how far it reaches to each side."""

    height: float
    wide: float
    ahead: float
    behind: float


# Heights above the hips as shares of the way to the shoulders.
TORSO = (
    RingShape(0.05, 0.160, 0.091, 0.114),
    RingShape(0.12, 0.160, 0.104, 0.120),
    RingShape(0.26, 0.148, 0.098, 0.102),
    RingShape(0.42, 0.132, 0.094, 0.084),
    RingShape(0.60, 0.148, 0.106, 0.094),
)
# Heights beside the shoulders, m. The first three hold the arms; their widths are beside the
# shoulder joints.
SHOULDERS = (
    RingShape(-0.085, -0.014, 0.116, 0.108),
    RingShape(-0.020, -0.020, 0.100, 0.104),
    RingShape(0.036, -0.038, 0.066, 0.082),
    RingShape(0.060, 0.098, 0.052, 0.070),
    RingShape(0.082, 0.062, 0.050, 0.062),
)
ARM_ROWS = slice(len(TORSO) + 1, len(TORSO) + 4)
"""Rings of the trunk between which the arms begin."""
# Heights beside the joint below the head, m.
HEAD = (
    RingShape(-0.042, 0.055, 0.050, 0.064),
    RingShape(-0.034, 0.046, 0.084, 0.068),
    RingShape(-0.014, 0.061, 0.100, 0.082),
    RingShape(0.010, 0.068, 0.104, 0.094),
    RingShape(0.030, 0.072, 0.104, 0.102),
    RingShape(0.058, 0.074, 0.095, 0.108),
    RingShape(0.084, 0.076, 0.103, 0.110),
    RingShape(0.120, 0.074, 0.096, 0.107),
    RingShape(0.152, 0.062, 0.074, 0.088),
    RingShape(0.173, 0.038, 0.041, 0.053),
)
CROWN = 0.181
CHIN = 0.115
"""Height of the lowest ring of the head above the shoulders, m, at least."""
# How far some points of the head's rings stand out, by ring and by columns from the middle: the
# nose, the sockets of the eyes and the chin tell ahead from behind.
RELIEF = {3: {0: 0.012}, 4: {0: 0.030}, 5: {0: 0.016, 1: -0.005, 2: -0.004}, 6: {0: 0.003}}
# Height of the groin beside the hip joints, at the sides and in the middle; points of the crotch
# from front to back: height and distance ahead.
GROIN_SIDE, GROIN_MIDDLE, GROIN = 0.025, -0.070, RingShape(0.0, 0.074, 0.082, 0.100)
CROTCH = ((-0.088, 0.045), (-0.096, -0.006), (-0.088, -0.058))
NECK = 0.055
"""Height above the shoulders, m, up to which the joint that holds the arms moves the skin."""
BELOW = 0.12
"""Length, m, of the part below the pelvis that the pelvis moves."""


@dataclass(frozen=True)
class Trunk:
    """Points of the trunk in a mesh, which legs and arms are welded to.

    rings: from the groin up. crotch: from front to back. chain: bones from pelvis to head.
    """

    rings: tuple[list[int], ...]
    crotch: tuple[int, ...]
    chain: BoneChain


@dataclass(frozen=True)
class TrunkFrame:
    """Middle of the hips, the shoulders and the lower end of the head (3,), m."""

    plan: PersonPlan
    hips: Floats
    shoulders: Floats
    head: Floats

    def ring(self, height: float, shape: RingShape) -> Floats:
        """Return points (COLUMNS, 3) at a height; the shape's own is not used."""
        turn = 2.0 * np.pi * np.arange(COLUMNS) / COLUMNS
        back = np.sin(turn)
        deep = np.where(back > 0, -shape.behind, -shape.ahead) * back
        return self.point(height, shape.wide * np.cos(turn), deep)

    def point(self, height: float | Floats, side: float | Floats, ahead: float | Floats) -> Floats:
        """Return points beside the middle of the body at a height, in the person's scale."""
        knots = np.stack([self.hips, self.shoulders, self.head])
        middle = [np.interp(height, knots[:, 1], knots[:, axis]) for axis in (0, 2)]
        flat = np.stack(np.broadcast_arrays(middle[0], height, middle[1]), axis=-1)
        scale = self.plan.scale
        across = np.multiply.outer(side, self.plan.side) + np.multiply.outer(ahead, self.plan.front)
        found: Floats = flat + scale * across
        return found


def frame(plan: PersonPlan) -> TrunkFrame:
    """Return the frame of a person's trunk."""
    hips, shoulders = (
        np.mean([limb.point(limb.root) for limb in pair], axis=0) for pair in (plan.legs, plan.arms)
    )
    head = plan.trunk.points[plan.head].copy()
    head[1] = max(head[1], shoulders[1] + plan.scale * (CHIN - HEAD[0].height))
    return TrunkFrame(plan, hips, shoulders, head)


def build(mesh: MeshBuilder, plan: PersonPlan) -> Trunk:
    """Return the trunk, added to a mesh with its head but without the faces where arms begin."""
    own = frame(plan)
    chain = trunk_chain(plan, own)
    rings = tuple(_add(mesh, chain, points) for points in _rings(own))
    for lower, upper in pairwise(rings):
        mesh.join(lower, upper)
    removed = {face for ring in rings[ARM_ROWS][:2] for face in _arm_faces(mesh, ring)}
    mesh.faces[:] = [face for face in mesh.faces if face not in removed]
    crown = own.point(own.head[1] + plan.scale * CROWN, 0.0, -0.012)
    mesh.close(rings[-1], _add(mesh, chain, crown[None])[0])
    crotch = [
        own.point(own.hips[1] + plan.scale * height, 0.0, ahead)[None] for height, ahead in CROTCH
    ]
    return Trunk(rings, tuple(_add(mesh, chain, point)[0] for point in crotch), chain)


def _rings(own: TrunkFrame) -> list[Floats]:
    scale, hips, shoulders = own.plan.scale, own.hips[1], own.shoulders[1]
    hip_width = _half_width(own.plan, 0) / scale
    rings = [_groin(own, GROIN._replace(wide=hip_width + GROIN.wide))]
    for shape in TORSO:
        rings.append(own.ring(hips + shape.height * (shoulders - hips), shape))
    reach = _half_width(own.plan, 1) / scale
    for index, shape in enumerate(SHOULDERS):
        wide = reach + shape.wide if index < 3 else shape.wide
        rings.append(own.ring(shoulders + scale * shape.height, shape._replace(wide=wide)))
    for index, shape in enumerate(HEAD):
        rings.append(_face(own, index, own.ring(own.head[1] + scale * shape.height, shape)))
    return rings


def _half_width(plan: PersonPlan, pair: int) -> float:
    left, right = (plan.legs, plan.arms)[pair]
    return 0.5 * float((left.point(left.root) - right.point(right.root)) @ plan.side)


def _groin(own: TrunkFrame, shape: RingShape) -> Floats:
    """Return the lowest ring: high at the sides and low in the middle, where the legs part."""
    across = np.abs(np.cos(2.0 * np.pi * np.arange(COLUMNS) / COLUMNS))
    points = own.ring(float(own.hips[1]), shape)
    lift = own.plan.scale * (GROIN_MIDDLE + (GROIN_SIDE - GROIN_MIDDLE) * across)
    return points + lift[:, None] * UP


def _face(own: TrunkFrame, index: int, points: Floats) -> Floats:
    for off, out in RELIEF.get(index, {}).items():
        for column in {FRONT + off, FRONT - off}:
            points[column] += own.plan.scale * out * own.plan.front
    return points


def _add(mesh: MeshBuilder, chain: BoneChain, points: Floats) -> list[int]:
    """Add points, each moved by the place of the chain that is as high as their middle."""
    return mesh.add_ring(points, chain, chain.nearest(points.mean(axis=0)))


def _arm_faces(mesh: MeshBuilder, ring: Sequence[int]) -> list[tuple[int, ...]]:
    """Return the faces above a ring that the arms take the place of."""
    columns = {(middle + off) % COLUMNS for middle in (LEFT, RIGHT) for off in (-2, -1, 0, 1)}
    starts = {ring[column] for column in columns}
    follows = {ring[column]: ring[(column + 1) % COLUMNS] for column in columns}
    return [f for f in mesh.faces if f[0] in starts and f[1] == follows[f[0]]]


def leg_loop(trunk: Trunk, left: bool) -> list[int]:
    """Return the points that a leg begins with, in the order of its rings."""
    groin, crotch = trunk.rings[0], list(trunk.crotch)
    around = [*range(BACK, LEFT - 1, -1), *range(COLUMNS - 1, FRONT - 1, -1)]
    if not left:
        around, crotch = list(range(FRONT, BACK - 1, -1)), crotch[::-1]
    return [groin[column] for column in around] + crotch


def arm_loop(trunk: Trunk, left: bool) -> list[int]:
    """Return the points that an arm begins with, in the order of its rings."""
    low, middle, high = trunk.rings[ARM_ROWS]
    around = [((LEFT if left else RIGHT) + off) % COLUMNS for off in (-2, -1, 0, 1, 2)]
    return [
        *(low[column] for column in around),
        middle[around[-1]],
        *(high[column] for column in reversed(around)),
        middle[around[0]],
    ]


def trunk_chain(plan: PersonPlan, own: TrunkFrame) -> BoneChain:
    """Return the chain that moves the trunk.

    The pelvis moves what lies below it, and the joint that holds the arms moves the shoulders,
    although the neck may begin below them.
    """
    trunk, base = plan.trunk, own.shoulders[1] + plan.scale * NECK
    lowest = trunk.points[0] - plan.scale * BELOW * UP
    pelvis = trunk.anchors[0]
    anchors, joints, points = [pelvis, pelvis], [pelvis, trunk.joints[0]], [lowest, trunk.points[0]]
    chest = plan.arms[0].chain.anchors[0]
    beyond = False
    for index in range(1, len(trunk.points)):
        point = trunk.points[index].copy()
        if beyond:
            point[1] = max(point[1], base)
        beyond = beyond or trunk.anchors[index] == chest
        turning = trunk.joints[min(index, len(trunk.joints) - 1)]
        if beyond and trunk.anchors[index] == chest and turning != chest:
            # Neck and chest coincide: the chest moves the skin up to the neck.
            anchors, joints, points = [*anchors, chest], [*joints, chest], [*points, point]
            point = np.array([point[0], base, point[2]])
        if np.linalg.norm(point - points[-1]) < bone_chain.SHORTEST:
            joints[-1] = turning
            continue
        anchors, joints, points = (
            [*anchors, trunk.anchors[index]],
            [*joints, turning],
            [*points, point],
        )
    return BoneChain(
        tuple(anchors), tuple(joints[: len(points) - 1]), np.array(points), trunk.tipped
    )
