"""Orientations of a motion copied to a rig, whose other joints keep their rest.

A joint of the rig has the orientation W A, with W of the joint that it follows and a constant A
that turns the rig's rest pose to the motion's: bones of limbs point alike, so that a T pose and an
A pose are one; the trunk, whose bones differ between skeletons, turns as a whole; soles are flat
where the motion's are. Some files are at rest with all bones along one axis, or with feet that
point down: their motions get an upright reference pose with flat feet first.
"""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from posefield.common.units import UP, Booleans, Floats, Rotations, Vector
from posefield.feet.limbs import shortest_turn
from posefield.motion import quat
from posefield.motion.skeleton import joint_chain
from posefield.retarget.role_map import SIDES, Body, Chain, PosedBody

FLOOR = 1.0 - UP
"""Factors of a vector that leave its part along the floor."""
UPRIGHT = 0.7
"""Vertical part of the directions of legs and trunk at rest from which on a body stands."""
SAME_SLOPE = np.radians(10.0)
"""Difference of the slopes of two feet at rest up to which both are taken as flat."""
FLAT_SHARE = 30.0
"""Percentile of the heights of an ankle in stances up to which its foot is flat."""


def with_upright_rest(motion: PosedBody) -> PosedBody:
    """Return a motion whose body is at rest as in its most upright frame, if its own rest is not.

    Positions stay; orientations are those against the new rest.
    """
    if is_upright(motion.body):
        return motion
    joints = motion.body.joints
    feet = 0.5 * (motion.of_role("leftFoot") + motion.of_role("rightFoot"))
    top = motion.of_role(next(role for role in ("neck", "head", "hips") if role in joints))
    frame = int(np.argmax(np.round((top - feet) @ UP, 4)))
    positions = motion.positions[frame]
    bones = positions - positions[list(motion.body.parents)]
    bones[0] = positions[0]
    turns = quat.mul(motion.orientations, quat.conj(motion.orientations[frame]))
    return replace(motion, body=replace(motion.body, bones=bones), orientations=turns)


def is_upright(body: Body) -> bool:
    """Return whether a body stands at rest: legs below the hips, the trunk above."""
    ways = [body.direction(side + "Foot", side + "UpperLeg") for side in SIDES]
    top = next((role for role in ("neck", "head") if role in body.joints), None)
    ways += [] if top is None else [body.direction("hips", top)]
    across = body.direction("rightUpperLeg", "leftUpperLeg") * FLOOR
    return (
        min(direction @ UP for direction in ways) > UPRIGHT
        and float(np.linalg.norm(across)) > UPRIGHT
    )


@dataclass(frozen=True)
class Sole:
    """Foot of a body at rest.

    toes (3,): from the ankle to the toes, m; zero without them. pitch: by which the foot is turned
    for its sole to be flat, rad, toes upwards.
    """

    toes: Vector
    pitch: float = 0.0

    @property
    def slope(self) -> float:
        """Return the angle of the toes above the ankle at rest, rad."""
        return float(np.arctan2(self.toes @ UP, np.linalg.norm(self.toes * FLOOR)))

    @property
    def flattening(self) -> Floats:
        """Return the rotation (4,) that makes the sole flat."""
        forward = self.toes * FLOOR / max(float(np.linalg.norm(self.toes * FLOOR)), 1e-9)
        return quat.from_axis_angle(quat.cross(forward, UP), np.array(self.pitch))

    @property
    def flat_toes(self) -> Vector:
        """Return the vector (3,), m, from the ankle to the toes of the flat foot."""
        flattened: Vector = quat.rotate(self.flattening, self.toes)
        return flattened


def sole_at_rest(body: Body, side: str) -> Sole:
    """Return the sole of a foot that is flat at rest."""
    ankle, tip = body.joints[side + "Foot"], body.joints.get(side + "Toes")
    return Sole(np.zeros(3) if tip is None else body.rest[tip] - body.rest[ankle])


def sole_of_motion(
    motion: PosedBody, side: str, standing: Annotated[Booleans, "frames"], rig: Sole
) -> Sole:
    """Return the sole of a foot of a motion, flat as it is while it stands with a low ankle.

    standing (F,): whether the foot stands. rig: the sole to be compared; one of the same slope at
    rest is flat at rest too, as is a foot that never stands or has no toes.
    """
    sole = sole_at_rest(motion.body, side)
    is_same = abs(sole.slope - rig.slope) <= SAME_SLOPE
    if not standing.any() or not sole.toes.any() or not rig.toes.any() or is_same:
        return sole
    ankles, toes = motion.of_role(side + "Foot")[standing], motion.of_role(side + "Toes")[standing]
    heights = ankles @ UP
    low = heights <= np.percentile(heights, FLAT_SHARE)
    soles = (toes - ankles)[low]
    slopes = np.arctan2(soles @ UP, np.linalg.norm(soles * FLOOR, axis=-1))
    return replace(sole, pitch=float(np.median(slopes)) - sole.slope)


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
    heading = quat.from_axis_angle(UP, np.array(source.facing - rig.facing))
    turns = {role: heading for role in rig.joints if role in source.joints}
    for side, (source_sole, rig_sole) in zip(SIDES, soles, strict=True):
        for upper, lower in BONES:
            bone = (side + upper, side + lower)
            if {*bone} <= turns.keys():
                rig_direction = quat.rotate(heading, rig.direction(*bone))
                turns[bone[0]] = quat.mul(
                    shortest_turn(rig_direction, source.direction(*bone)), heading
                )
        turns[side + "Foot"] = _foot_turn(source_sole, rig_sole, heading)
        for end, before in FOLLOWERS.items():
            if {side + end, side + before} <= turns.keys():
                turns[side + end] = turns[side + before]
    return turns


def _foot_turn(source_sole: Sole, rig_sole: Sole, heading: Floats) -> Floats:
    """Return the rotation (4,) of a foot that is flat where the motion's is, and points alike."""
    rig_toes, source_toes = quat.rotate(heading, rig_sole.toes), source_sole.flat_toes
    if min(np.hypot(rig_toes[0], rig_toes[2]), np.hypot(source_toes[0], source_toes[2])) < SHORTEST:
        return heading
    angle = np.arctan2(source_toes[0], source_toes[2]) - np.arctan2(rig_toes[0], rig_toes[2])
    turned = quat.mul(quat.from_axis_angle(UP, np.array(angle)), heading)
    return quat.mul(quat.conj(source_sole.flattening), turned)


def copy_orientations(
    source: Body, rig: Body, turns: Annotated[Floats, "frames _ 4"], soles: Soles
) -> Rotations:
    """Return the local rotations (F, J, 4) of the rig.

    turns (F, S, 4): orientations of the motion's joints. soles: as of `align_rests`. Joints of
    spine and neck follow the motion's by their places along the chain. Others without a role follow
    a joint of the same name, as its part of the body does; without one they keep their rest against
    their parents.
    """
    aligned = align_rests(source, rig, soles)
    world: dict[int, Floats] = {
        rig.joints[role]: quat.mul(turns[:, source.joints[role]], turn)
        for role, turn in aligned.items()
    }
    aligned_joints = {rig.joints[role]: turn for role, turn in aligned.items()}
    heading = aligned["hips"]
    for rig_chain, source_chain in ((rig.spine, source.spine), (rig.neck, source.neck)):
        if rig_chain.joints and source_chain.joints:
            for joint, share in zip(rig_chain.joints, rig_chain.shares.tolist(), strict=True):
                world[joint] = quat.mul(_along(source_chain, turns, share), heading)
    for joint, namesake in _namesakes(source, rig, set(world)).items():
        chain = joint_chain(rig.parents, joint)[-2::-1]
        above = next((turn for turn in chain if turn in aligned_joints), None)
        if above is not None:
            world[joint] = quat.mul(turns[:, namesake], aligned_joints[above])
    return _local(rig.parents, world, len(turns))


def _namesakes(source: Body, rig: Body, mapped: set[int]) -> dict[int, int]:
    """Return the joints without a role whose names both skeletons have, by joint of the rig."""
    used = set(source.joints.values())
    free = {name: joint for joint, name in enumerate(source.names) if joint not in used}
    return {
        joint: free[name]
        for joint, name in enumerate(rig.names)
        if joint not in mapped and name in free
    }


def _along(chain: Chain, turns: Annotated[Floats, "frames _ 4"], share_of_chain: float) -> Floats:
    """Return the orientation (F, 4) at a place, 0 to 1, of a chain."""
    after = min(int(np.searchsorted(chain.shares, share_of_chain - 1e-9)), len(chain.joints) - 1)
    before = max(after - 1, 0)
    first, last = chain.shares[before], chain.shares[after]
    if last - share_of_chain < 1e-9 or last <= first:
        return turns[:, chain.joints[after]]
    share = np.array((share_of_chain - first) / (last - first))
    interpolated: Floats = quat.slerp(
        turns[:, chain.joints[before]], turns[:, chain.joints[after]], share
    )
    return interpolated


def _local(parents: tuple[int, ...], world: dict[int, Floats], frames: int) -> Rotations:
    """Return local rotations (F, J, 4) of joints of which some have a known orientation."""
    local = np.empty((frames, len(parents), 4))
    local[:] = quat.IDENTITY
    turns: list[Floats] = []
    for joint, parent in enumerate(parents):
        above = turns[parent] if parent >= 0 else np.broadcast_to(quat.IDENTITY, (frames, 4))
        if joint in world:
            local[:, joint] = quat.mul(quat.conj(above), world[joint])
            turns.append(world[joint])
        else:
            turns.append(above)
    return local
