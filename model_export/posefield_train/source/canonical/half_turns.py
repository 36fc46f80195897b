"""Detection and removal of half turns that come from the mocap solver.

An occluded marker leaves the twist of a finger or a toe undetermined, and the solver can be half a
turn off afterwards, between two frames or for a whole take. Only joints that move little are
corrected, so that no joint position changes by more than a few centimetres. A solver also turns a
thigh half about its own axis when the knee is bent far, and the shin against it. Such a twist is
moved on to the joint's children, which changes no position at all. Each correction is reported.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import Vector
from posefield.common.units import Floats
from posefield.motion import quat, skeleton
from posefield.motion.clip import Clip
from posefield_train.source.canonical import clip_blocks

# Rotations of a joint are hardly visible if all its descendants lie within a hand's length, m.
HAND_SIZE = 0.15
# Angle between two frames above which a rotation is a jump, rad.
JUMP_ANGLE = 1.5
# Bones that are shorter have no direction, m; bones count as along one axis above this cosine.
SHORTEST_BONE, ALONG = 1e-6, 0.999
# Largest rotation, rad, besides the twist about the bone, of a jump that is such a twist.
MOST_SWING = 0.5
# Angle from the family's mean above which a whole clip counts as flipped, rad.
FLIP_ANGLE = 0.75 * np.pi


@dataclass(frozen=True)
class Finding:
    """A correction or warning for one joint of one clip. angle: rad.

    kind: "jump" corrected between two frames, "twist" moved to the children between two frames,
    "flip" corrected for the whole clip, "wrap" unwrapped past half a turn from the mean, or "far",
    close to half a turn.
    """

    kind: str
    joint: int
    clip: int
    angle: float


def small_joints(parents: tuple[int, ...], offsets: Floats) -> Floats:
    """Return a mask (J,) of joints whose descendants lie within HAND, by bone offsets (J, 3), m."""
    rest = np.broadcast_to(quat.IDENTITY, (*offsets.shape[:-1], 4))
    positions = skeleton.positions(parents, rest, offsets)
    gaps = np.linalg.norm(positions[:, None] - positions, axis=-1)
    small: Floats = (gaps * skeleton.descendant_matrix(parents)).max(axis=1) < HAND_SIZE
    return small


def remove_jumps(clip: Clip, index: int) -> tuple[Clip, list[Finding]]:
    """Return the clip with jumps of twists and of small joints removed, and the corrections."""
    clip, findings = move_twists(clip, index)
    turned = _step_angles(clip.rotations)
    small = small_joints(clip.skeleton.parents, clip.translations[0])
    rotations = clip.rotations.copy()
    for joint in np.flatnonzero(small & (turned.max(axis=0, initial=0.0) > JUMP_ANGLE)):
        steps = _steps(clip.rotations[:, joint])
        kept = np.where(turned[:, joint, None] > JUMP_ANGLE, quat.IDENTITY, steps)
        for frame, step in enumerate(kept):
            rotations[frame + 1, joint] = quat.mul(rotations[frame, joint], step)
        findings.append(Finding("jump", int(joint), index, float(turned[:, joint].max())))
    return replace(clip, rotations=rotations), findings


def move_twists(clip: Clip, index: int) -> tuple[Clip, list[Finding]]:
    """Return the clip with jumps about a bone moved from its joint to the joint's children.

    The longest part of a clip without such a jump stays as it is. Positions do not change.
    """
    rotations, findings = clip.rotations.copy(), []
    for joint, axis in _bone_axes(clip):
        steps = _steps(rotations[:, joint])
        angles = np.linalg.norm(quat.log(steps), axis=-1)
        twists = quat.twist(steps, axis)
        swings = quat.mul(steps, quat.from_axis_angle(axis, -twists))
        swung = np.linalg.norm(quat.log(swings), axis=-1)
        jumps = (angles > JUMP_ANGLE) & (swung < MOST_SWING)
        if not jumps.any():
            continue
        moved = np.concatenate([[0.0], np.cumsum(np.where(jumps, twists, 0.0))])
        parts = np.split(np.arange(len(moved)), np.flatnonzero(jumps) + 1)
        moved -= moved[max(parts, key=len)[0]]
        own = quat.from_axis_angle(axis, moved)
        rotations[:, joint] = quat.mul(rotations[:, joint], quat.conj(own))
        for child in np.flatnonzero(np.array(clip.skeleton.parents) == joint):
            rotations[:, child] = quat.mul(own, rotations[:, child])
        findings.append(Finding("twist", joint, index, float(np.abs(twists[jumps]).max())))
    return (replace(clip, rotations=rotations) if findings else clip), findings


def _bone_axes(clip: Clip) -> Iterator[tuple[int, Vector]]:
    """Yield each joint that carries bones along one axis only, with that unit axis."""
    parents = np.array(clip.skeleton.parents)
    offsets = clip.translations.mean(axis=0)
    lengths = np.linalg.norm(offsets, axis=-1)
    for joint in range(len(parents)):
        children = np.flatnonzero((parents == joint) & (lengths > SHORTEST_BONE))
        if not len(children):
            continue
        axes = offsets[children] / lengths[children, None]
        if np.abs(axes @ axes[0]).min() > ALONG:
            yield joint, axes[0]


def _steps(rotations: Annotated[Floats, "*frames 4"]) -> Annotated[Floats, "*steps 4"]:
    """Return the rotations (F - 1, ...) from each frame to the next."""
    return quat.mul(quat.conj(rotations[:-1]), rotations[1:])


def _step_angles(rotations: Floats) -> Floats:
    return np.asarray(np.linalg.norm(quat.log(_steps(rotations)), axis=-1))


def remove_flips(rotations: Floats, small: Floats) -> tuple[Floats, list[Finding]]:
    """Return aligned rotations (N, T, J, 4) with flips of small joints removed, and findings.

    A flip is a small joint that is half a turn from its mean throughout a clip.
    """
    means = quat.mean(rotations.reshape(-1, *rotations.shape[2:]))
    return remove_flips_about(means, rotations, small)


def remove_flips_about(
    means: Floats, rotations: Floats, small: Floats
) -> tuple[Floats, list[Finding]]:
    """Return the result of `remove_flips` relative to given means (J, 4)."""
    blocks = clip_blocks.clip_blocks(len(rotations))
    least = np.concatenate([_least_angles(means, rotations[rows]) for rows in blocks])
    flips = np.argwhere((least > FLIP_ANGLE) & small.astype(bool))
    clean, findings = rotations.copy() if len(flips) else rotations, []
    for clip, joint in flips:
        away = quat.mul(quat.conj(means[joint]), rotations[clip, :, joint])
        offset = quat.mean(away[:, None])[0]
        # mean⁻¹ q = offset · the motion itself; the offset alone is the flip.
        itself = quat.mul(quat.conj(offset), away)
        clean[clip, :, joint] = quat.mul(means[joint], itself)
        angle = float(np.linalg.norm(quat.log(offset)))
        findings.append(Finding("flip", int(joint), int(clip), angle))
    return clean, findings


def _least_angles(means: Floats, rotations: Floats) -> Floats:
    """Return the least angle (N, J) of aligned rotations (N, T, J, 4) from their means, rad."""
    away = quat.mul(quat.conj(means), rotations)
    return np.asarray(np.linalg.norm(quat.log(away), axis=-1).min(axis=1))
