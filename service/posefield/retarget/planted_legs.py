"""Pelvis and legs of a rig whose feet follow their paths: the pelvis first, then the legs."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import Frames, RootPath, Rotations
from posefield.common.units import UP, Floats
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


def raised(rig: PosedRig, height: Frames) -> PosedRig:
    """Return poses whose root is raised by a height (F,), m."""
    shift = height[:, None] * UP
    places = rig.places + shift[:, None]
    return PosedRig(rig.body, rig.rotations, rig.roots + shift, places, rig.turns)


@dataclass(frozen=True)
class PlantedLegs:
    """Poses whose feet follow their paths. copied: before. lowered: of the pelvis (F,), m."""

    rig: PosedRig
    copied: PosedRig
    paths: Annotated[Floats, "frames feet 3"]
    lowered: Frames


def plant(
    rig: PosedRig, feet: SourceFeet, heels: Annotated[Floats, "frames feet"], rate: float
) -> PlantedLegs:
    """Return the poses with the feet on their paths.

    feet: of the motion, in proportion. heels (F, 2): depth below the floor of the motion's heels,
    m, which the rig's may have too.
    """
    heights = foot_paths.standing_heights(feet, rig.body)
    copied = _at(rig, feet.roles)
    wanted = feet.paths @ UP + heights - feet.heights
    rig = raised(rig, _pelvis_height(wanted - copied @ UP, feet.standing, rate))
    copied = _at(rig, feet.roles)
    paths = foot_paths.plan_paths(feet, copied, heights, rate)
    paths += _heel_lifts(rig, paths - copied, heights, heels)[..., None] * UP
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
    lowered = pelvis.lower(needs, most, rate, False)
    rotations = rig.rotations.copy()
    shift = -lowered[:, None] * UP
    for (leg, poses), target in zip(legs, targets, strict=True):
        turn_limb(rotations, leg, poses, shift, target)
    return PlantedLegs(posed(rig.body, rotations, rig.roots + shift), rig, paths, lowered)


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


def _at(rig: PosedRig, roles: tuple[str, ...]) -> Annotated[Floats, "frames roles 3"]:
    return np.stack([rig.of_role(role) for role in roles], axis=1)


def _pelvis_height(
    apart: Annotated[Floats, "frames feet"], standing: Annotated[Floats, "frames feet"], rate: float
) -> Frames:
    """Return how much higher the pelvis has to be (F,), m, for the feet that stand, smoothly."""
    weights = standing.sum(axis=1)
    if not weights.any():
        return np.full(len(apart), float(np.median(apart)))
    reach = len(apart)
    steps = np.arange(-reach, reach + 1) / (SMOOTHING * rate)
    # Far from all stances the nearest one counts.
    kernel = np.exp(-0.5 * np.square(steps)) + 1e-12 / (1.0 + np.square(steps))
    wanted, known = (
        np.convolve(values, kernel, mode="valid")
        for values in (_padded((apart * standing).sum(axis=1), reach), _padded(weights, reach))
    )
    found: Frames = wanted / known
    return found


def _padded(values: Frames, reach: int) -> Frames:
    return np.pad(values.astype(float), reach)


def _heel_lifts(
    rig: PosedRig,
    moved: Annotated[Floats, "frames feet 3"],
    heights: Annotated[Floats, "feet"],
    heels: Annotated[Floats, "frames feet"],
) -> Annotated[Floats, "frames feet"]:
    """Return how much each foot is lifted (F, 2), m, so that its heel is not below the floor.

    moved: from the copied feet to their paths, m. The motion's own depth stays.
    """
    depths = heel_depths(rig, heights) - moved @ UP
    found: Floats = np.maximum(depths - np.maximum(heels, 0.0), 0.0)
    return found


def heel_depths(
    rig: PosedRig, heights: Annotated[Floats, "feet"], scale: float = 1.0
) -> Annotated[Floats, "frames feet"]:
    """Return how deep below the floor each heel is (F, 2), m; negative above it.

    The heel is the point below the ankle that is on the floor at rest, in which the joint that
    stands, toes or the foot, is at its height (2,), m. scale: of the places against the rest.
    """
    joints, rest, found = rig.body.joints, rig.body.rest, []
    for side, height in zip(SIDES, heights.tolist(), strict=True):
        ankle = joints[side + "Foot"]
        tip = joints.get(side + "Toes", ankle)
        sole = (scale * (rest[tip] - rest[ankle]) - height) * UP
        heel = rig.places[:, ankle] + quat.rotate(rig.turns[:, ankle], sole)
        found.append(-heel @ UP)
    return np.stack(found, axis=1)
