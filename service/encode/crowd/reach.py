"""Boxes that characters never leave, for many motions at once.

Joints are placed exactly, by forward kinematics. Of the drawn body each end of a bone's box is
held by a ball about the joint that it is nearest to among those that turn with it: the same for
all frames, and never too small. A side may be too far out by the length of a tip: 18 cm of a head.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np
import numpy.typing as npt

from service.encode import bounds
from service.encode.character import Rig
from service.motion import quat
from service.motion.conventions import Floats, Singles
from service.motion.crowd import Motions, Placement

Joints = npt.NDArray[np.intp]

# Of float32 the last bits add up along a chain of joints and a path that leads away.
SLACK = 1e-5
CORNERS = np.array(list(product((False, True), repeat=3)))


@dataclass(frozen=True)
class Hull:
    """The P ends of a body's boxes: where they are and which joints hold them.

    ends (P, 3) in the frame of the joint that each turns with, radii (P,), m. holders (P,): that
    joint, or, where `moved`, one of its children, whose place hangs on the bone offsets.
    """

    parents: tuple[int, ...]
    holders: Joints
    moved: npt.NDArray[np.bool_]
    ends: Floats
    radii: Floats


def hull(parents: tuple[int, ...], rig: Rig) -> Hull:
    """Hull of a rig's body."""
    bones = rig.bones
    starts = bones.starts - rig.rest[bones.joints]
    ends = np.concatenate([starts, starts + bones.arms])
    joints = np.concatenate([bones.joints, bones.joints])
    holders = np.array([_holder(parents, rig, *end) for end in zip(joints, ends, strict=True)])
    radii = np.concatenate([bones.radii, bones.radii])
    return Hull(parents, holders, holders != joints, ends, radii)


def boxes(hull: Hull, motions: Motions) -> Floats:
    """Lowest and highest corner (M, 2, 3) of all that each motion does in its own frame, m."""
    places, balls = _positions(hull.parents, motions), _balls(hull, motions.bone_offsets)
    low = (places.min(axis=-1) - balls).min(axis=0)
    high = (places.max(axis=-1) + balls).max(axis=0)
    return bounds.outwards(low.T, high.T, SLACK)


def placed(placement: Placement, boxes: Floats) -> Floats:
    """Lowest and highest corner (2, 3) of boxes (N, 2, 3) that stand where the characters do, m."""
    low, high = boxes[:, 0], boxes[:, 1]
    corners = np.where(CORNERS, high[:, None], low[:, None])
    moved = quat.rotate(placement.turns[:, None], corners) + placement.positions[:, None]
    return bounds.outwards(moved.min(axis=(0, 1)), moved.max(axis=(0, 1)), SLACK)


def _holder(parents: tuple[int, ...], rig: Rig, joint: int, end: Floats) -> int:
    near = {child: rig.offsets[child] for child, parent in enumerate(parents) if parent == joint}
    near[joint] = np.zeros(3)
    return min(near, key=lambda holder: float(np.linalg.norm(end - near[holder])))


def _balls(hull: Hull, offsets: Singles) -> Floats:
    """Radius (J, 1, M) about each joint within which the ends lie that it holds."""
    anchors = np.where(hull.moved[:, None], offsets[:, hull.holders], 0.0)
    reach = np.linalg.norm(hull.ends - anchors, axis=-1) + hull.radii
    balls = np.zeros(offsets.shape[1::-1])
    np.maximum.at(balls, hull.holders, reach.T)
    return balls[:, None]


def _positions(parents: tuple[int, ...], motions: Motions) -> Singles:
    """Joint positions (J, 3, M, F), m.

    Components come first, unlike elsewhere: it is eight times as fast for crowds.
    """
    turns = motions.rotations.transpose(2, 3, 0, 1).copy()
    arms = motions.bone_offsets.transpose(1, 2, 0)[..., None]
    places = np.empty((len(parents), 3, *motions.rotations.shape[:2]), np.float32)
    places[0] = motions.root_position.transpose(2, 0, 1)
    for joint, parent in enumerate(parents[1:], start=1):
        places[joint] = places[parent] + _rotate(turns[parent], arms[joint])
        # In place: nothing reads a joint's local turn once its parent's is known.
        turns[joint] = _mul(turns[parent], turns[joint])
    return places


def _mul(a: Singles, b: Singles) -> Singles:
    w, x, y, z = b
    return np.stack(
        [
            a[0] * w - a[1] * x - a[2] * y - a[3] * z,
            a[0] * x + a[1] * w + a[2] * z - a[3] * y,
            a[0] * y - a[1] * z + a[2] * w + a[3] * x,
            a[0] * z + a[1] * y - a[2] * x + a[3] * w,
        ]
    )


def _rotate(q: Singles, v: Singles) -> Singles:
    w, u = q[0], q[1:]
    t = 2.0 * _cross(u, v)
    return v + w * t + _cross(u, t)


def _cross(a: Singles, b: Singles) -> Singles:
    return np.stack(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )
