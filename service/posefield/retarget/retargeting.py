"""Retargeting of a clip to a rig: orientations by role, then pelvis, feet and hands."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from posefield.common.array_shapes import RootPath
from posefield.common.units import UP
from posefield.motion import clip as clips
from posefield.motion import skeleton
from posefield.motion.clip import Clip
from posefield.retarget import copied_pose, role_map
from posefield.retarget.retarget_report import USUAL, RetargetReport, RetargetSettings
from posefield.retarget.role_map import SIDES, Body
from posefield.rigs.rig import Rig


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
    places, turns = skeleton.forward_kinematics(
        clip.skeleton.parents, clip.rotations, clip.translations
    )
    rotations = copied_pose.copy_orientations(source, body, turns)
    scale = body.leg_length / source.leg_length
    hips = places[:, [source.joints[side + "UpperLeg"] for side in SIDES]].mean(axis=1)
    roots = _roots(body, rotations, _scaled(hips, scale))
    made = clips.assemble(rig.skeleton, rotations, roots, rig.skeleton.offsets, clip.rate)
    mapped = tuple(role for role in source.joints if role in body.joints)
    missing = tuple(role for role in source.joints if role not in body.joints)
    return Retargeted(
        replace(made, curves=clip.curves),
        RetargetReport(mapped, missing, scale, warnings=rig.notes),
    )


def _scaled(path: RootPath, scale: float) -> RootPath:
    """Return a path (F, 3), m, in another proportion about the floor below its start."""
    start = path[0] * (1.0 - UP)
    found: RootPath = start + scale * (path - start)
    return found


def _roots(body: Body, rotations: np.ndarray, hips: RootPath) -> RootPath:
    """Return the root's path (F, 3), m, that brings the middle of both hips to a path (F, 3)."""
    still = np.zeros((len(rotations), 1, 3))
    offsets = body.bones.copy()
    offsets[0] = 0.0
    placed = skeleton.positions(body.parents, rotations, offsets + 0.0 * still)
    own = placed[:, [body.joints[side + "UpperLeg"] for side in SIDES]].mean(axis=1)
    found: RootPath = hips - own
    return found
