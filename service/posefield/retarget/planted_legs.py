"""Pelvis and legs of a rig whose feet follow their paths: the pelvis first, then the legs."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common import frame_groups
from posefield.common.array_shapes import Frames, RootPath, Rotations
from posefield.common.units import UP, Booleans, Floats
from posefield.feet import pelvis, two_bone
from posefield.feet.limbs import Limb, LimbPoses
from posefield.motion import quat, skeleton
from posefield.retarget import foot_paths
from posefield.retarget.foot_paths import SourceFeet
from posefield.retarget.role_map import SIDES, Body

SMOOTHING = 0.12
"""Width, s, of the Gaussian with which the height of the pelvis follows the feet that stand."""
DEEPEST = 0.1
"""Most by which the pelvis is lowered so that the legs reach, as a share of their length."""
FREE_DEPTH, MOST_DEPTH = 0.007, 0.01
"""Depths of soles below the floor that stay as they are, and that none exceeds, m: soles give."""
SAME = 1e-6
"""Distance, m, up to which the end of a limb is where it is wanted, and the limb stays."""


@dataclass(frozen=True)
class PosedRig:
    """Poses of a rig. rotations (F, J, 4): local. roots (F, 3), places (F, J, 3), m."""

    body: Body
    rotations: Rotations
    roots: RootPath
    places: Annotated[Floats, "frames joints 3"]
    turns: Annotated[Floats, "frames joints 4"]

    def of_role(self, role: str) -> RootPath:
        """Return the positions (F, 3), m, of the joint of a role."""
        return self.places[:, self.body.joints[role]]

    def limb(self, roles: tuple[str, ...]) -> tuple[Limb, LimbPoses]:
        """Return the limb of joints of roles, and its poses; joints between them do not turn."""
        own = [self.body.joints[role] for role in roles]
        joints = (self.body.parents[own[0]], *own)
        rest = self.body.rest[list(joints)]
        bones = np.diff(rest, axis=0, prepend=rest[:1])
        parents = tuple(range(-1, len(joints) - 1))
        places, turns = self.places[:, list(joints)], self.turns[:, list(joints)]
        limb = Limb(own[0], own[1], own[2], own[-1])
        return limb, LimbPoses(joints, parents, bones, places, turns)


def posed(body: Body, rotations: Rotations, roots: RootPath) -> PosedRig:
    """Return poses with the positions and orientations of their joints."""
    moved = skeleton.translations(body.bones, roots)
    return PosedRig(
        body,
        rotations,
        roots,
        *skeleton.forward_kinematics(body.parents, rotations, moved),
    )


def moved(rig: PosedRig, shift: RootPath) -> PosedRig:
    """Return poses whose root is moved by (F, 3), m."""
    places = rig.places + shift[:, None]
    return PosedRig(rig.body, rig.rotations, rig.roots + shift, places, rig.turns)


@dataclass(frozen=True)
class PlantedLegs:
    """Poses whose feet follow their paths.

    copied: before. depths (F, 2): of soles below the floor, m. lowered: of the pelvis (F,), m.
    """

    rig: PosedRig
    copied: PosedRig
    depths: Annotated[Floats, "frames feet"]
    lowered: Frames


@dataclass(frozen=True)
class RigSoles:
    """Soles of a rig's feet.

    heights (2,): of the joints that stand above the soles, m. heels (2, 3): vectors at rest from
    the ankles to the soles below, m. limited: whether their depth below the floor is limited.
    """

    heights: Annotated[Floats, "feet"]
    heels: Annotated[Floats, "feet 3"]
    limited: bool = True


def plant(rig: PosedRig, feet: SourceFeet, soles: RigSoles, rate: float) -> PlantedLegs:
    """Return the poses with the feet on their paths. feet: of the motion, in proportion."""
    copied = _at(rig, feet.roles)
    wanted = feet.paths @ UP + soles.heights - feet.heights
    rig = moved(rig, _pelvis_height(wanted - copied @ UP, feet.standing, rate)[:, None] * UP)
    copied = _at(rig, feet.roles)
    paths = foot_paths.plan_paths(feet, copied, soles.heights, rate)
    depths = sole_depths(rig, soles, feet.floors, paths, paths - copied)
    if soles.limited:
        paths += limited_lifts(depths)[..., None] * UP
    legs = [
        rig.limb((side + "UpperLeg", side + "LowerLeg", side + "Foot", role))
        if role != side + "Foot"
        else rig.limb((side + "UpperLeg", side + "LowerLeg", role))
        for side, role in zip(SIDES, feet.roles, strict=True)
    ]
    targets = [
        poses.position(leg.lower) + paths[:, foot] - copied[:, foot]
        for foot, (leg, poses) in enumerate(legs)
    ]
    needs = [
        pelvis.need(poses, leg, target, np.zeros(len(target)))
        for (leg, poses), target in zip(legs, targets, strict=True)
    ]
    most = np.full(len(paths), DEEPEST * rig.body.leg_length)
    lowered = pelvis.lower(needs, most, frame_groups.one_row(len(most), rate))
    rotations = rig.rotations.copy()
    shift = -lowered[:, None] * UP
    for (leg, poses), target in zip(legs, targets, strict=True):
        turn_limb(rotations, leg, poses, shift, target)
    made = posed(rig.body, rotations, rig.roots + shift)
    still = np.zeros(paths.shape)
    depths = sole_depths(made, soles, feet.floors, _at(made, feet.roles), still)
    return PlantedLegs(made, rig, depths, lowered)


def turn_limb(
    rotations: Rotations, limb: Limb, poses: LimbPoses, shift: RootPath, target: RootPath
) -> None:
    """Turn a limb in poses (F, J, 4) so that its end comes to a target (F, 3), m.

    shift (F, 3): movement of its upper joint, m. Frames in which it is there stay as they are.
    """
    apart = np.linalg.norm(target - shift - poses.position(limb.lower), axis=-1)
    moved = apart > SAME
    if not moved.any():
        return
    before = rotations.copy()
    found = two_bone.solve(poses, limb, two_bone.reach(poses, limb, shift, target))
    found.apply(limb, rotations)
    rotations[~moved] = before[~moved]


def _at(rig: PosedRig, roles: tuple[str, str]) -> Annotated[Floats, "frames feet 3"]:
    """Return the positions (F, 2, 3), m, of the joints of two roles."""
    return np.stack([rig.of_role(role) for role in roles], axis=1)


def _pelvis_height(
    apart: Annotated[Floats, "frames feet"],
    standing: Annotated[Booleans, "frames feet"],
    rate: float,
) -> Frames:
    """Return how much higher the pelvis has to be (F,), m, for the feet that stand, smoothly."""
    weights = standing.sum(axis=1).astype(float)
    if not weights.any():
        return np.full(len(apart), float(np.median(apart)))
    half = max(1, round(4.0 * SMOOTHING * rate))
    kernel = np.exp(-0.5 * np.square(np.arange(-half, half + 1) / (SMOOTHING * rate)))
    wanted, known = (
        np.convolve(np.pad(values, half), kernel, mode="valid")
        for values in ((apart * standing).sum(axis=1), weights)
    )
    near = np.flatnonzero(known > 0.0)
    # Far from all stances those before and after count.
    return np.asarray(np.interp(np.arange(len(apart)), near, wanted[near] / known[near]))


def sole_depths(
    rig: PosedRig,
    soles: RigSoles,
    floors: Annotated[Floats, "frames feet"],
    paths: Annotated[Floats, "frames feet 3"],
    shift: Annotated[Floats, "frames feet 3"],
) -> Annotated[Floats, "frames feet"]:
    """Return how deep the sole of each foot is below its floor (F, 2), m; negative above it.

    The deeper of ball and heel. floors (F, 2): heights, m. paths: of the joints that stand, m.
    shift: of the ankles against the poses (F, 2, 3), m.
    """
    found = floors + soles.heights - paths @ UP
    for foot, side in enumerate(SIDES):
        ankle = rig.body.joints[side + "Foot"]
        heel = rig.places[:, ankle] + quat.rotate(rig.turns[:, ankle], soles.heels[foot])
        below = floors[:, foot] - (heel + shift[:, foot]) @ UP
        found[:, foot] = np.maximum(found[:, foot], below)
    return found


def limited_lifts(depths: Floats) -> Floats:
    """Return by how much feet are lifted (F, 2), m, so that no sole is deeper than the limit.

    Depths up to FREE_DEPTH stay as they are; deeper ones approach the limit.
    """
    soft = MOST_DEPTH - FREE_DEPTH
    beyond = np.maximum(depths - FREE_DEPTH, 0.0)
    found: Floats = beyond - soft * -np.expm1(-beyond / soft)
    return found
