"""Root bone: a joint on the floor above the hips that carries travel and heading, for engines.

Bob, sway and lean stay in the hips, and no other joint moves in the world.
"""

from dataclasses import replace

import numpy as np

from posefield.common.units import UP, Floats
from posefield.motion import joint_roles, quat, skeleton
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton

SMOOTHING = 0.4
"""Standard deviation, s, of the weights by which the path of the hips is smoothed: a stride takes
about a second."""
SAME_POSE = 1e-4
"""Largest difference of a quaternion product from 1 up to which a clip ends in its first pose."""


def with_root(joints: Skeleton) -> Skeleton:
    """Return the skeleton with a root bone at the origin, above the hips."""
    name = joint_roles.free_name("root", set(joints.names))
    return Skeleton(
        (name, *joints.names),
        (-1, *(parent + 1 for parent in joints.parents)),
        np.concatenate([np.zeros((1, 3)), joints.offsets]),
        tuple(joint + 1 for joint in joints.tip_joints),
        joints.tip_offsets,
    )


def add_root(clip: Clip, joints: Skeleton) -> Clip:
    """Return the clip with the skeleton that `with_root` returns."""
    still = np.broadcast_to(quat.IDENTITY, (len(clip), 1, 4)), np.zeros((len(clip), 1, 3))
    rotations = np.concatenate([still[0], clip.rotations], axis=1)
    translations = np.concatenate([still[1], clip.translations], axis=1)
    posed = replace(clip, skeleton=joints, rotations=rotations, translations=translations)
    return move_root(posed, 1)


def move_root(clip: Clip, hips: int) -> Clip:
    """Return the clip with the travel and heading of the hips in the root, above them.

    The root keeps its height at rest. Its child on the way to the hips stays in the world; its
    other children, such as joints for inverse kinematics, follow it.
    """
    parents = clip.skeleton.parents
    positions, turns = skeleton.forward_kinematics(parents, clip.rotations, clip.translations)
    headings = np.unwrap(quat.twist(turns[:, hips], UP))
    chain = skeleton.joint_chain(parents, hips)
    rest = [joint for joint in range(len(parents)) if joint not in chain]
    same = np.abs(np.sum(clip.rotations[0, rest] * clip.rotations[-1, rest], axis=-1))
    is_loop = len(clip) > 2 and bool(np.all(same > 1.0 - SAME_POSE))
    path = _smooth(np.column_stack([positions[:, hips, [0, 2]], headings]), clip.rate, is_loop)
    heading = quat.from_axis_angle(UP, path[:, 2])
    root = quat.rotate(heading, clip.skeleton.offsets[0])
    root[:, [0, 2]] += path[:, :2]
    child = chain[1]
    rotations, translations = clip.rotations.copy(), clip.translations.copy()
    rotations[:, 0], translations[:, 0] = heading, root
    rotations[:, child] = quat.mul(quat.conj(heading), turns[:, child])
    translations[:, child] = quat.rotate(quat.conj(heading), positions[:, child] - root)
    return replace(clip, rotations=rotations, translations=translations, root_bone=False)


def _smooth(path: Floats, rate: float, is_loop: bool) -> Floats:
    """Return a path (F, C) without sway: that of a loop repeats, another keeps both its ends."""
    line = np.linspace(path[0], path[-1], len(path))
    sway = path - line
    cycle = sway[:-1] if is_loop else np.concatenate([sway, -sway[-2:0:-1]])
    frequencies = np.fft.rfftfreq(len(cycle), 1.0 / rate)
    gains = np.exp(-0.5 * np.square(2.0 * np.pi * SMOOTHING * frequencies))
    smoothed = np.fft.irfft(gains[:, None] * np.fft.rfft(cycle, axis=0), len(cycle), axis=0)
    whole_path: Floats = line + np.concatenate([smoothed, smoothed[:1]])[: len(path)]
    return whole_path
