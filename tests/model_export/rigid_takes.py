"""Motion files of a rigid body whose right arm is raised forward or to the side, for discovery."""

import numpy as np

from posefield.motion import bvh_writer
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton

RATE = 30.0
JOINTS = {
    "Hips": (None, (0.0, 0.92, 0.0)),
    "Neck": ("Hips", (0.0, 0.5, 0.0)),
    "Head": ("Neck", (0.0, 0.2, 0.0)),
    "LeftArm": ("Neck", (0.18, -0.05, 0.0)),
    "LeftForeArm": ("LeftArm", (0.0, -0.28, 0.0)),
    "LeftHand": ("LeftForeArm", (0.0, -0.26, 0.0)),
    "RightArm": ("Neck", (-0.18, -0.05, 0.0)),
    "RightForeArm": ("RightArm", (0.0, -0.28, 0.0)),
    "RightHand": ("RightForeArm", (0.0, -0.26, 0.0)),
    "LeftUpLeg": ("Hips", (0.1, 0.0, 0.0)),
    "LeftLeg": ("LeftUpLeg", (0.0, -0.43, 0.0)),
    "LeftFoot": ("LeftLeg", (0.0, -0.43, 0.0)),
    "LeftToeBase": ("LeftFoot", (0.0, -0.05, 0.13)),
    "RightUpLeg": ("Hips", (-0.1, 0.0, 0.0)),
    "RightLeg": ("RightUpLeg", (0.0, -0.43, 0.0)),
    "RightFoot": ("RightLeg", (0.0, -0.43, 0.0)),
    "RightToeBase": ("RightFoot", (0.0, -0.05, 0.13)),
}
ORDERS = ("FSFFSF", "SFFFSS", "SFSSFF", "FFSFSS")
"""Motions of each take: the arm is raised forward or to the side, in no order that repeats."""


def skeleton(size=1.0, extra=False):
    """The body; size: of its bones. extra: whether it has one joint more."""
    joints = dict(JOINTS) | ({"Hat": ("Head", (0.0, 0.1, 0.0))} if extra else {})
    names = tuple(joints)
    parents = tuple(-1 if own is None else names.index(own) for own, _ in joints.values())
    offsets = size * np.array([offset for _, offset in joints.values()])
    tips = tuple(sorted(set(range(len(names))) - set(parents)))
    return Skeleton(names, parents, offsets, tips, np.full((len(tips), 3), 0.01))


def clip(order, seed, size=1.0, extra=False):
    """A take of raises of the arm, each to a random angle, with rests between them."""
    rng = np.random.default_rng(seed)
    forward, sideways, at = np.zeros(round(25 * RATE)), np.zeros(round(25 * RATE)), 1.0
    times = np.arange(len(forward)) / RATE
    for kind in order:
        seconds, angle = rng.uniform(1.6, 2.0), rng.uniform(1.2, 2.4)
        wave = np.sin(np.pi * np.clip((times - at) / seconds, 0.0, 1.0)) ** 2
        (forward if kind == "F" else sideways)[:] += angle * wave
        at += seconds + rng.uniform(0.8, 1.8)
    body = skeleton(size, extra)
    turns = np.zeros((len(times), len(body.names), 4))
    turns[..., 0] = 1.0
    arm = body.names.index("RightArm")
    both = np.stack([-forward, np.zeros(len(times)), -sideways], axis=1)
    turn = np.linalg.norm(both, axis=1)
    axis = both / np.maximum(turn, 1e-9)[:, None]
    turns[:, arm, 0], turns[:, arm, 1:] = np.cos(turn / 2), np.sin(turn / 2)[:, None] * axis
    # The head follows, and the root drifts: no two clips are equal.
    turns[:, 1, 0], turns[:, 1, 1] = np.cos(0.05 * turn), np.sin(0.05 * turn)
    local = np.repeat(body.offsets[None], len(times), axis=0)
    local[:, 0, 0] += 0.01 * np.sin(times + seed)
    return Clip(body, turns, local, RATE)


def write_takes(folder):
    """Write four takes of two performers, ann and bob, in centimetres."""
    folder.mkdir(parents=True, exist_ok=True)
    for index, order in enumerate(ORDERS):
        name = f"{('ann', 'bob')[index % 2]}_{index}.bvh"
        own = clip(order, index, (1.0, 1.06)[index % 2])
        (folder / name).write_bytes(bvh_writer.dumps(own, metres_per_unit=0.01))
    return folder
