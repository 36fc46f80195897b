"""Retargeting of a clip to a rig: orientations by role, then pelvis, feet and hands."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from posefield.common.array_shapes import RootPath
from posefield.common.units import UP
from posefield.motion import clip as clips
from posefield.motion import skeleton
from posefield.motion.clip import Clip
from posefield.retarget import (
    copied_pose,
    foot_paths,
    hand_goals,
    planted_legs,
    reference_pose,
    retarget_measures,
    role_map,
)
from posefield.retarget.foot_paths import FLOOR, SourceFeet
from posefield.retarget.planted_legs import PlantedLegs, PosedRig, RigSoles
from posefield.retarget.rest_alignment import Soles
from posefield.retarget.retarget_report import USUAL, HandGoal, RetargetReport, RetargetSettings
from posefield.retarget.role_map import SIDES, Body
from posefield.rigs.rig import Rig

SAME_BONE = 1e-4
"""Difference of the lengths of bones up to which they are the same, m."""
MISSED = 1e-3
"""Distance of a hand from its target, m, from which on it is told."""


@dataclass(frozen=True)
class Retargeted:
    """A clip of a rig's skeleton, and the report on it."""

    clip: Clip
    report: RetargetReport


def retarget(
    clip: Clip, rig: Rig, roles: Mapping[str, str], settings: RetargetSettings = USUAL
) -> Retargeted:
    """Return a clip on the skeleton of a rig.

    roles: joint of the clip by role, of the model's card; recognised by names where it has none.
    The result has the rig's skeleton in metres with Y up, identity rotations at rest, constant bone
    offsets and a moving root, as clips of models have; `Rig.file_rotations` and
    `Rig.file_translations` give the values of the rig's file. Curves stay. Raises InvalidField
    for a motion without hips and two legs.
    """
    source = role_map.body_of_motion(clip.skeleton, clip.translations[0], roles)
    body = role_map.body_of_rig(rig)
    motion = PosedRig(
        source,
        clip.rotations,
        clip.root_path,
        *skeleton.forward_kinematics(clip.skeleton.parents, clip.rotations, clip.translations),
    )
    motion = reference_pose.with_upright_rest(motion)
    scale = body.leg_length / source.leg_length
    motion = _scaled(motion, scale, scale if settings.travel == "scaled" else 1.0)
    feet = _feet(motion, body, clip, settings)
    ground = _ground(motion, body, feet, scale)
    made = _planted(motion, body, feet, ground, clip.rate)
    hand_goals.check_goals(settings.hands, made.rig, clip.rate)
    final = hand_goals.meet_goals(made.rig, settings.hands, clip.rate)
    found = clips.assemble(
        rig.skeleton, final.rotations, final.roots, rig.skeleton.offsets, clip.rate
    )
    report = retarget_measures.measure(feet, made, ground.scale, clip.rate)
    mapped, missing = _mapped(source, body)
    missed = hand_goals.misses(final, settings.hands, clip.rate)
    warnings = (*rig.notes, *_warnings(missing, settings.hands, missed))
    return Retargeted(
        replace(found, curves=clip.curves),
        replace(report, mapped=mapped, missing=missing, hands_missed=missed, warnings=warnings),
    )


def _scaled(motion: PosedRig, scale: float, travel: float) -> PosedRig:
    """Return poses in another proportion: the body by `scale`, the way of its hips by `travel`.

    Both about the floor below the hips in the first frame.
    """
    hips = _hips(motion)
    level = hips * FLOOR
    moved = level[:1] + travel * (level - level[:1])
    places = moved[:, None] + scale * (motion.places - level[:, None])
    return replace(motion, places=places)


def _hips(rig: PosedRig) -> RootPath:
    """Return the path (F, 3), m, of the middle between both hips."""
    left, right = (rig.of_role(side + "UpperLeg") for side in SIDES)
    return 0.5 * (left + right)


def _feet(motion: PosedRig, body: Body, clip: Clip, settings: RetargetSettings) -> SourceFeet:
    """Return the feet of a motion in the rig's proportion."""
    roles = foot_paths.contact_roles(motion.body, body)
    left, right = (motion.body.joints[role] for role in roles)
    names = clip.skeleton.names[left], clip.skeleton.names[right]
    paths = motion.places[:, [left, right]]
    return foot_paths.feet_of(paths, clip.rate, roles, names, settings.stances)


@dataclass(frozen=True)
class _Ground:
    """Ground contact of a motion's and of a rig's feet.

    scale: length of the rig's legs over that of the motion's. soles: of the motion's and the rig's
    left and right foot. higher: ankles of the rig above those of the motion in proportion, m.
    below: heights and heels of the rig.
    """

    scale: float
    soles: Soles
    higher: float
    below: RigSoles


def _ground(motion: PosedRig, body: Body, feet: SourceFeet, scale: float) -> _Ground:
    """Return how the feet of a motion and of a rig stand."""
    heights, standing = foot_paths.standing_heights(feet, body), feet.standing
    ours = [reference_pose.sole_at_rest(body, side) for side in SIDES]
    theirs = [
        reference_pose.sole_of_motion(motion, side, standing[:, foot], ours[foot])
        for foot, side in enumerate(SIDES)
    ]
    left, right = zip(theirs, ours, strict=True)
    drops = [(scale * before.flat_toes - after.toes) @ UP for before, after in (left, right)]
    on_toes = feet.roles[0].endswith("Toes")
    higher = float(np.mean(heights - feet.heights) + on_toes * np.mean(drops))
    heels = [
        (on_toes * sole.toes @ UP - height) * UP for sole, height in zip(ours, heights, strict=True)
    ]
    # A character of the same bones has the motion as it is.
    bones = motion.body.leg_bones, body.leg_bones
    limited = len(bones[0]) != len(bones[1]) or not np.allclose(*bones, rtol=0.0, atol=SAME_BONE)
    below = RigSoles(heights, np.stack(heels), limited)
    return _Ground(scale, (left, right), higher, below)


def _planted(
    motion: PosedRig, body: Body, feet: SourceFeet, ground: _Ground, rate: float
) -> PlantedLegs:
    """Return the rig with copied orientations, and its feet on their paths."""
    rotations = copied_pose.copy_orientations(motion.body, body, motion.turns, ground.soles)
    still = planted_legs.posed(body, rotations, np.zeros((len(rotations), 3)))
    rig = planted_legs.moved(still, _hips(motion) + ground.higher * UP - _hips(still))
    return planted_legs.plant(rig, feet, ground.below, rate)


def _mapped(source: Body, rig: Body) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the roles of a motion that a rig has, and those that it lacks."""
    found = tuple(role for role in source.joints if role in rig.joints)
    return found, tuple(role for role in source.joints if role not in rig.joints)


def _warnings(
    missing: Sequence[str], goals: Sequence[HandGoal], missed: Sequence[float]
) -> Iterator[str]:
    """Yield sentences on what the character lacks or does not reach."""
    if missing:
        yield f"the character has no joint for {', '.join(missing)}: they do not move"
    for goal, miss in zip(goals, missed, strict=True):
        if miss > MISSED:
            yield f"{goal.role} at {goal.time:g} s: {miss:.3f} m from its target, out of reach"
