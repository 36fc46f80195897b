"""Extents of the characters of a crowd.

All characters share one body mesh, made for the model's own bones, while each has its own bone
offsets. Each end of a bone's box is bounded by a sphere about the nearest of its joint and the
joint's children; the radii are the same for all frames and never too small.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np
import numpy.typing as npt

from posefield.common.units import Floats, Singles
from posefield.encode.character import body_mesh, extent
from posefield.encode.character.animation_samples import AnimationSamples
from posefield.encode.character.character import CharacterRig
from posefield.encode.character.extent import PointTree
from posefield.motion import quat
from posefield.motion.crowd_clip import Placement

PointIndices = npt.NDArray[np.intp]

CORNERS = np.array(list(product((False, True), repeat=3)))


@dataclass(frozen=True)
class BodyHull:
    """The E ends of a body's boxes, and the points about which spheres bound them.

    ends (E, 3): in the frame of the joint that each is skinned to, m. radii: (E,), m. holders (E,):
    that joint or, where `moved`, one of its child joints or tips, whose position depends on the
    bone offsets.
    """

    tree: PointTree
    holders: PointIndices
    moved: npt.NDArray[np.bool_]
    ends: Floats
    radii: Floats


def hull(rig: CharacterRig) -> BodyHull:
    """Return the hull of a rig's body."""
    joints, offsets = rig.skeleton, rig.skeleton.offsets
    drawn, turning = body_mesh.bone_boxes(joints, rig.bones, offsets), rig.bones.joints
    starts = drawn.starts - joints.at_rest(offsets)[turning]
    ends, turned = np.concatenate([starts, starts + drawn.arms]), np.tile(turning, 2)
    holders = np.array([_holder_index(rig, *end) for end in zip(turned, ends, strict=True)])
    return BodyHull(rig.tree, holders, holders != turned, ends, np.tile(drawn.radii, 2))


def boxes(hull: BodyHull, made: AnimationSamples) -> Floats:
    """Return the lowest and highest corner (M, 2, 3) of each motion in its own frame, m."""
    return extent.bounding_boxes(hull.tree, made, _sphere_radii(hull, made.offsets))


def placed_box(placement: Placement, boxes: Floats) -> Floats:
    """Return a box (2, 3) in the world, m, around boxes (N, 2, 3) of placed characters."""
    low, high = boxes[:, 0], boxes[:, 1]
    corners = np.where(CORNERS, high[:, None], low[:, None])
    moved = quat.rotate(placement.turns[:, None], corners) + placement.positions[:, None]
    return extent.enlarged_box(moved.min(axis=(0, 1)), moved.max(axis=(0, 1)))


def _holder_index(rig: CharacterRig, joint: int, end: Floats) -> int:
    above = (*rig.skeleton.parents, *rig.skeleton.tip_joints)
    arms = np.concatenate([rig.skeleton.offsets, rig.skeleton.tip_offsets])
    near = {point: arms[point] for point, holder in enumerate(above) if holder == joint}
    near[joint] = np.zeros(3)
    return min(near, key=lambda holder: float(np.linalg.norm(end - near[holder])))


def _sphere_radii(hull: BodyHull, offsets: Singles) -> Floats:
    """Return the radius (M, P) of the sphere about each joint and tip, m."""
    tips = np.broadcast_to(hull.tree.tips, (len(offsets), *hull.tree.tips.shape))
    anchors = np.concatenate([offsets, tips], axis=1)[:, hull.holders]
    reached = hull.ends - np.where(hull.moved[:, None], anchors, 0.0)
    radii = np.linalg.norm(reached, axis=-1) + hull.radii
    balls = np.zeros((len(offsets), offsets.shape[1] + len(hull.tree.tips)))
    np.maximum.at(balls, (np.arange(len(offsets))[:, None], hull.holders), radii)
    return balls
