"""Crowds for the readers' tests: supported ones, known unsupported ones and a wrong one.

Eight characters play five motions; all positions, headings and sizes differ.
"""

from pathlib import Path

import cases
import numpy as np

from posefield.encode import crowd_size, crowd_writer
from posefield.motion import clip as clips
from posefield.motion import quat
from posefield.motion.clip import CrowdClip, Motions, Placement

MOTION = np.array([0, 1, 2, 3, 4, 2, 0, 1])
FRAMES = 20
CONTROL = "crowd_turned"
"""Name of the crowd whose characters all face ahead."""
FILES = [
    *((f"crowd_{instancing}", "usdc", instancing) for instancing in crowd_size.INSTANCING),
    ("crowd_folder", "usd", "references"),
    ("crowd_archive", "usdz", "references"),
    ("crowd_flatten", "usda", "flatten"),
    ("crowd_flatten", "usdz", "flatten"),
]
UNREAD = {
    # Blender's default import makes one armature of all instances, and leaves it at rest.
    ("blender", "crowd_scenegraph"),
    # three.js composes no layers.
    *(("three", f"crowd_{name}") for name in ("references", "scenegraph", "folder", "archive")),
}


def write(folder: Path) -> dict[str, dict[str, Path]]:
    """The crowds in many layouts, and by file name and character what to expect of it."""
    made, placement = _motions(), _placement()
    expectations = {f"c{i:05}": folder / f"c{i:05}.npz" for i in range(len(MOTION))}
    for index, path in enumerate(expectations.values()):
        np.savez(path, **_expected(made, placement, index))
    ahead = Placement(placement.positions, np.zeros(len(MOTION)))
    crowd_writer.write(_crowd(made, ahead), folder / f"{CONTROL}.usdc", "flatten")
    for name, ending, instancing in FILES:
        crowd_writer.write(_crowd(made, placement), folder / f"{name}.{ending}", instancing)
    names = [f"{CONTROL}.usdc", *(f"{name}.{ending}" for name, ending, _ in FILES)]
    return dict.fromkeys(names, expectations)


def _crowd(made: Motions, placement: Placement) -> CrowdClip:
    return CrowdClip(cases.person(), 30.0, FRAMES, placement, MOTION, [made], {"seed": 7})


def _expected(made: Motions, placement: Placement, index: int) -> dict[str, np.ndarray]:
    motion = MOTION[index]
    turns, offsets = made.rotations[motion].astype(float), made.bone_offsets[motion]
    own = clips.assemble(cases.person(), turns, made.root_position[motion], offsets, 30.0)
    stands = np.eye(4)
    stands[:3, :3] = quat.to_matrix(placement.turns[index])
    stands[:3, 3] = placement.positions[index]
    meant = cases.matrices_of(own)
    return {"joints": meant["joints"], "matrices": stands @ meant["matrices"]}


def _motions() -> Motions:
    rng, count, person = np.random.default_rng(7), MOTION.max() + 1, cases.person()
    t = np.arange(FRAMES) / 30
    phases = rng.uniform(0, 2 * np.pi, (count, 1, len(person), 3))
    turns = quat.exp(0.6 * np.sin(2 * np.pi * t[:, None, None] + phases))
    path = (0, 0.9, 0) + rng.uniform(-1, 1, (count, 1, 3)) * (1.5, 0.05, 1.5) * t[:, None]
    offsets = rng.uniform(0.85, 1.15, (count, len(person), 1)) * person.offsets
    levels = np.zeros((count, FRAMES), int)
    return Motions(turns.astype("f4"), path.astype("f4"), offsets.astype("f4"), levels)


def _placement() -> Placement:
    rng = np.random.default_rng(8)
    positions = rng.uniform(-5, 5, (len(MOTION), 3)) * (1, 0, 1)
    headings = rng.uniform(-np.pi, np.pi, len(MOTION))
    # Whole numbers are stored in another way.
    positions[:2], headings[0] = [(0, 0, 0), (1, 2, 3)], 0.0
    return Placement(positions, headings)
