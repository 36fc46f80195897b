"""Topology of a recipe's clips: conversion, refusal of long ways, and notes."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from posefield.common.units import Floats
from posefield.motion.clip import Clip
from posefield_train.source.rigs import bone_stretch
from posefield_train.source.topology import unified_clips
from posefield_train.source.topology.role_joints import (
    LIMB_ROLES,
    StatedRoles,
    TopologyError,
)
from posefield_train.source.topology.unified_clips import UnifiedClips

MOST_NAMED = 6
"""Joints that a note names."""
FAR = 99
"""Percentile of the distances that a note tells."""


def unify(
    clips: Sequence[Clip], files: Sequence[str], stated: StatedRoles, stretches: bool
) -> tuple[tuple[Clip, ...], list[str]]:
    """Return clips on the topology that their skeletons have in common, and notes.

    files: names by clip. stated: joints by role. stretches: whether a bone may change its length
    where a joint was left out on it. Raises TopologyError for a skeleton that lacks a role, and for
    such a change.
    """
    found = unified_clips.unify(clips, stated)
    if not stretches:
        _expect_rigid(found)
    return found.clips, [*_kind_notes(clips, files, found), *_lack_notes(files, found)]


def _expect_rigid(found: UnifiedClips) -> None:
    """Raise TopologyError for a joint that moves against its parent since one was left out."""
    stretch = bone_stretch.find_stretch(found.clips)
    if stretch is None:
        return
    number = next(at for at, kind in enumerate(found.kinds) if stretch.clip in kind.clips)
    kind, places, topology = found.kinds[number], found.points[number], found.topology
    name, parent = topology.names[stretch.joint], topology.names[topology.parents[stretch.joint]]
    if unified_clips.is_rigid(kind.skeleton, places[parent], places[name]):
        return
    raise TopologyError(
        f"skeleton.topology: joints between {parent} and {name} are left out, since other files "
        f"lack them or no role has them, and {name} moves by up to {100 * stretch.distance:.1f} cm "
        f"against {parent}, expected at most {100 * stretch.limit:.2g} cm; say motion.bones = "
        "'stretch' to keep the mean, or leave out the files with fewer joints",
        stretch.clip,
    )


def _kind_notes(clips: Sequence[Clip], files: Sequence[str], found: UnifiedClips) -> list[str]:
    """Return the note on each kind of skeleton: joints left out, and how far the others moved."""
    names = found.topology.names
    limbs = np.array([name in LIMB_ROLES for name in names])
    notes = []
    for kind, places in zip(found.kinds, found.points, strict=True):
        gaps = np.concatenate(
            [
                _distances(found.clips[at], unified_clips.joint_motion(clips[at], places).positions)
                for at in kind.clips
            ]
        )
        limb, trunk = (100 * np.percentile(gaps[:, own], FAR) for own in (limbs, ~limbs))
        which = f"{len(kind.clips)} of {len(clips)} clips, such as {files[kind.clips[0]]}: "
        notes.append(
            f"{which}{len(kind.skeleton)} joints became {len(names)} by their roles"
            f"{_named(kind.left_out)}; {FAR} % of the joints lie within {limb:.2f} cm (limbs) and "
            f"{trunk:.2f} cm (trunk) of the files'"
        )
    return notes


def _named(left_out: Sequence[str]) -> str:
    """Return the joints that are left out as a part of a sentence."""
    more = len(left_out) - MOST_NAMED
    told = ", ".join(left_out[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")
    return f", without {told}" if left_out else ""


def _distances(clip: Clip, positions: Floats) -> Floats:
    """Return the distances (F, J), m, of a clip's joints with mean offsets from positions."""
    translations = clip.translations.copy()
    translations[:, 1:] = translations[:, 1:].mean(axis=0)
    placed = replace(clip, translations=translations).positions()
    return np.asarray(np.linalg.norm(placed - positions, axis=-1))


def _lack_notes(files: Sequence[str], found: UnifiedClips) -> list[str]:
    """Return the note on roles that some skeletons have and others lack."""
    everyone = {role for kind in found.kinds for role in kind.joints.limbs}
    notes = []
    for role in LIMB_ROLES:
        lacking = [kind for kind in found.kinds if role not in kind.joints.limbs]
        if role in everyone and lacking:
            count = sum(len(kind.clips) for kind in lacking)
            notes.append(
                f"{role} is left out: {count} of {len(files)} clips, such as "
                f"{files[lacking[0].clips[0]]}, have no joint for it"
            )
    return notes
