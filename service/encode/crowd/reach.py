"""Boxes that the characters of a crowd never leave.

All of them share one body, drawn for the model's own bones, while each has bones of its own. Of
the body each end of a bone's box is held by a ball about the joint or tip that it is nearest to
among those that turn with it: the same for all frames, and never too small.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np
import numpy.typing as npt

from service.encode import body, reach
from service.encode.character import Rig
from service.encode.moves import Moves
from service.encode.reach import Tree
from service.motion import quat
from service.motion.conventions import Floats, Singles
from service.motion.crowd import Placement

Places = npt.NDArray[np.intp]

CORNERS = np.array(list(product((False, True), repeat=3)))


@dataclass(frozen=True)
class Hull:
    """The E ends of a body's boxes: where they are and which points hold them.

    ends (E, 3) in the frame of the joint that each turns with, radii (E,), m. holders (E,): that
    joint, or, where `moved`, a joint or tip that hangs on it, whose place hangs on the offsets.
    """

    tree: Tree
    holders: Places
    moved: npt.NDArray[np.bool_]
    ends: Floats
    radii: Floats


def hull(rig: Rig) -> Hull:
    """Hull of a rig's body."""
    joints, offsets = rig.skeleton, rig.skeleton.offsets
    drawn, turning = body.boxes(joints, rig.bones, offsets), rig.bones.joints
    starts = drawn.starts - joints.at_rest(offsets)[turning]
    ends, turned = np.concatenate([starts, starts + drawn.arms]), np.tile(turning, 2)
    holders = np.array([_holder(rig, *end) for end in zip(turned, ends, strict=True)])
    return Hull(rig.tree, holders, holders != turned, ends, np.tile(drawn.radii, 2))


def boxes(hull: Hull, made: Moves) -> Floats:
    """Lowest and highest corner (M, 2, 3) of all that each motion does in its own frame, m."""
    return reach.boxes(hull.tree, made, _balls(hull, made.offsets))


def placed(placement: Placement, boxes: Floats) -> Floats:
    """Lowest and highest corner (2, 3) of boxes (N, 2, 3) that stand where the characters do, m."""
    low, high = boxes[:, 0], boxes[:, 1]
    corners = np.where(CORNERS, high[:, None], low[:, None])
    moved = quat.rotate(placement.turns[:, None], corners) + placement.positions[:, None]
    return reach.outwards(moved.min(axis=(0, 1)), moved.max(axis=(0, 1)))


def _holder(rig: Rig, joint: int, end: Floats) -> int:
    above = (*rig.skeleton.parents, *rig.skeleton.tip_joints)
    arms = np.concatenate([rig.skeleton.offsets, rig.skeleton.tip_offsets])
    near = {point: arms[point] for point, holder in enumerate(above) if holder == joint}
    near[joint] = np.zeros(3)
    return min(near, key=lambda holder: float(np.linalg.norm(end - near[holder])))


def _balls(hull: Hull, offsets: Singles) -> Floats:
    """Radius (M, P) about each joint and tip within which the ends lie that it holds."""
    tips = np.broadcast_to(hull.tree.tips, (len(offsets), *hull.tree.tips.shape))
    anchors = np.concatenate([offsets, tips], axis=1)[:, hull.holders]
    reached = hull.ends - np.where(hull.moved[:, None], anchors, 0.0)
    radii = np.linalg.norm(reached, axis=-1) + hull.radii
    balls = np.zeros((len(offsets), offsets.shape[1] + len(hull.tree.tips)))
    np.maximum.at(balls, (np.arange(len(offsets))[:, None], hull.holders), radii)
    return balls
