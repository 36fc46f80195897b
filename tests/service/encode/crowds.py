"""Crowds of any size with different motions, and the expected joint positions."""

import numpy as np

from posefield.motion import quat, skeleton
from posefield.motion.clip import CrowdClip, Motions, Placement

FACTS = {
    "model": "walk@0123abcd",
    "seed": 7,
    "controls": {"speed": 1.25, "from": [0.5, 1.5]},
    "warnings": ["speed is beyond 1.2"],
    "performer": None,
}


LAYOUTS = [
    ("usd", "references"),
    ("usd", "scenegraph"),
    ("usda", "flatten"),
    ("usdc", "references"),
    ("usdz", "scenegraph"),
    ("usdz", "flatten"),
]
"""Extensions and instancings of crowds: each of them, each kind of file, and no more."""
STREAMED = [layout for layout in LAYOUTS if layout[0] != "usd"]
CURVES = ("jawOpen", "Sole Left", "眉")
"""Names of curves that USD does not allow for prims."""


def motions(person, count, frames, seed=5, curves=0):
    """Smooth turns of every joint by up to a radian along lines, of people unlike in size."""
    rng = np.random.default_rng(seed)
    t = np.arange(frames) / 30
    phases = rng.uniform(0, 2 * np.pi, (count, 1, len(person), 3))
    turns = quat.exp(0.6 * np.sin(6.0 * t[:, None, None] + phases))
    signs = rng.choice([-1.0, 1.0], (count, frames, len(person), 1))
    speed = rng.uniform(-1, 1, (count, 1, 3)) * (1.5, 0.05, 1.5)
    path = person.offsets[0] + speed * t[:, None]
    size = rng.uniform(0.85, 1.15, (count, len(person), 1))
    levels = np.repeat(rng.integers(0, 3, (count, -(-frames // 10))), 10, axis=1)[:, :frames]
    arrays = (a.astype("f4") for a in (signs * turns, path, size * person.offsets))
    values = rng.uniform(0.0, 1.0, (count, frames, curves)).astype("f4") if curves else None
    return Motions(*arrays, levels, values)


def cut(made, size):
    """The same motions in batches of a size."""
    for start in range(0, len(made), size):
        part = slice(start, start + size)
        arrays = (None if value is None else value[part] for value in vars(made).values())
        yield Motions(*arrays)


def placement(count, seed=6):
    rng = np.random.default_rng(seed)
    positions = rng.uniform(-20, 20, (count, 3)) * (1, 0.05, 1)
    headings = rng.uniform(-np.pi, np.pi, count)
    # Readers have special ways to store these.
    positions[:2], headings[0] = [(0, 0, 0), (1, 2, 3)][:count], 0.0
    return Placement(positions, headings)


def crowd(person, made, motion, size=3):
    """Crowd whose characters play the motions that `motion` names."""
    return CrowdClip(
        skeleton=person,
        rate=30.0,
        frames=made.rotations.shape[1],
        placement=placement(len(motion)),
        motion=np.asarray(motion),
        batches=cut(made, size),
        facts=FACTS,
        curves=() if made.curves is None else CURVES[: made.curves.shape[2]],
    )


def positions(clip, made):
    """Joint positions (N, F, J, 3) in the world, m, by our own forward kinematics in float64."""
    moves = skeleton.translations(made.bone_offsets, made.root_position)
    own, _ = skeleton.forward_kinematics(clip.skeleton.parents, made.rotations.astype(float), moves)
    turns = clip.placement.turns[:, None, None]
    return quat.rotate(turns, own[clip.motion]) + clip.placement.positions[:, None, None]
