"""Alignment of rest poses: the rotation of each joint of a rig against the one that it follows.

A joint of the rig has the orientation W A, with W of the joint that it follows and a constant A
that turns the rig's rest pose to the motion's: bones of limbs point alike, so that a T pose and an
A pose are one; the trunk, whose bones differ between skeletons, turns as a whole; feet turn about
the vertical only, so that soles stay flat.
"""

import numpy as np

from posefield.common.units import UP, Floats
from posefield.feet.two_bone import shortest_turn
from posefield.motion import quat
from posefield.retarget.role_map import SIDES, Body

STEEP = 0.94
"""Vertical part of the direction of a foot at rest from which on it stands on its toes."""
BONES = (
    ("UpperLeg", "LowerLeg"),
    ("LowerLeg", "Foot"),
    ("UpperArm", "LowerArm"),
    ("LowerArm", "Hand"),
)
FOLLOWERS = {"Hand": "LowerArm", "Toes": "Foot"}
"""Ends of limbs, which turn as the part before them does at rest."""


def align_rests(source: Body, rig: Body) -> dict[str, Floats]:
    """Return the rotation (4,) of each role that both bodies have."""
    whole = quat.from_axis_angle(UP, np.array(source.facing - rig.facing))
    found = {role: whole for role in rig.joints if role in source.joints}
    for side in SIDES:
        for upper, lower in BONES:
            ends = (side + upper, side + lower)
            if {*ends} <= found.keys():
                old = quat.rotate(whole, rig.direction(*ends))
                found[ends[0]] = quat.mul(shortest_turn(old, source.direction(*ends)), whole)
        ends = (side + "Foot", side + "Toes")
        if {*ends} <= found.keys():
            old = quat.rotate(whole, rig.direction(*ends))
            found[ends[0]] = quat.mul(_sole_turn(old, source.direction(*ends)), whole)
        for end, before in FOLLOWERS.items():
            if {side + end, side + before} <= found.keys():
                found[side + end] = found[side + before]
    return found


def _sole_turn(old: Floats, new: Floats) -> Floats:
    """Return the rotation (4,) from one direction of a foot to another that keeps soles flat."""
    if max(abs(old[1]), abs(new[1])) > STEEP:
        return shortest_turn(old, new)
    angle = np.arctan2(new[0], new[2]) - np.arctan2(old[0], old[2])
    return quat.from_axis_angle(UP, np.array(angle))
