"""Alignment of rest poses: the rotation of each joint of a rig against the one that it follows.

A joint of the rig has the orientation W A, with W of the joint that it follows and a constant A
that turns the rig's rest pose to the motion's: bones of limbs point alike, so that a T pose and an
A pose are one; the trunk, whose bones differ between skeletons, turns as a whole; soles are flat
where the motion's are.
"""

import numpy as np

from posefield.common.units import UP, Floats
from posefield.feet.two_bone import shortest_turn
from posefield.motion import quat
from posefield.retarget.reference_pose import Sole
from posefield.retarget.role_map import SIDES, Body

SHORTEST = 0.01
"""Length of a foot over the floor, m, from which on its direction is known."""
Soles = tuple[tuple[Sole, Sole], tuple[Sole, Sole]]
BONES = (
    ("UpperLeg", "LowerLeg"),
    ("LowerLeg", "Foot"),
    ("UpperArm", "LowerArm"),
    ("LowerArm", "Hand"),
)
FOLLOWERS = {"Hand": "LowerArm", "Toes": "Foot"}
"""Ends of limbs, which turn as the part before them does at rest."""


def align_rests(source: Body, rig: Body, soles: Soles) -> dict[str, Floats]:
    """Return the rotation (4,) of each role that both bodies have.

    soles: of the motion's left and right foot, then of the rig's.
    """
    whole = quat.from_axis_angle(UP, np.array(source.facing - rig.facing))
    found = {role: whole for role in rig.joints if role in source.joints}
    for side, (theirs, ours) in zip(SIDES, soles, strict=True):
        for upper, lower in BONES:
            ends = (side + upper, side + lower)
            if {*ends} <= found.keys():
                old = quat.rotate(whole, rig.direction(*ends))
                found[ends[0]] = quat.mul(shortest_turn(old, source.direction(*ends)), whole)
        found[side + "Foot"] = _foot_turn(theirs, ours, whole)
        for end, before in FOLLOWERS.items():
            if {side + end, side + before} <= found.keys():
                found[side + end] = found[side + before]
    return found


def _foot_turn(theirs: Sole, ours: Sole, whole: Floats) -> Floats:
    """Return the rotation (4,) of a foot that is flat where the motion's is, and points alike."""
    old, new = quat.rotate(whole, ours.toes), theirs.flat_toes
    if min(np.hypot(old[0], old[2]), np.hypot(new[0], new[2])) < SHORTEST:
        return whole
    angle = np.arctan2(new[0], new[2]) - np.arctan2(old[0], old[2])
    turned = quat.mul(quat.from_axis_angle(UP, np.array(angle)), whole)
    return quat.mul(quat.conj(theirs.flattening), turned)
