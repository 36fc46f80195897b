"""Fixtures of hand-made answers: a person with unusual joint names, as a clip and as a pose."""

import numpy as np
import pytest

from posefield.motion import clip as clips
from posefield.motion import quat
from posefield.motion.skeleton import Skeleton
from posefield.question.results import ClipAnswer, Trust

TRUST = Trust(
    "walk@0123abcd",
    {"speed": 1.25, "turn rate": -0.5},
    "ada",
    0,
    1.5,
    0.0125,
    True,
    ("speed 1.25 is beyond 1.2",),
)

# name, parent, rest offset in metres.
JOINTS = [
    ("mixamorig:Hips", -1, (0.02, 0.95, 0.01)),
    ("Lower Back", 0, (0, 0.1, -0.01)),
    ("Lower-Back", 1, (0, 0.12, 0.0)),
    ("Spine", 2, (0, 0.12, 0.01)),
    ("Neck", 3, (0, 0.12, 0.01)),
    ("1Head", 4, (0, 0.1, 0.02)),
    ("左股", 0, (0, 0, 0)),
    ("LeftUpLeg", 6, (0.1, -0.05, 0.0)),
    ("LeftLeg", 7, (0.02, -0.42, 0.01)),
    ("LeftFoot", 8, (0.0, -0.4, -0.02)),
    ("右股", 0, (0, 0, 0)),
    ("RightUpLeg", 10, (-0.1, -0.05, 0.0)),
    ("RightLeg", 11, (-0.02, -0.42, 0.01)),
    ("RightFoot", 12, (0.0, -0.4, -0.02)),
    ("LeftArm", 3, (0.18, 0.05, 0.0)),
    ("LeftForeArm", 14, (0.28, 0.0, 0.0)),
    ("LeftHand", 15, (0.25, 0.0, 0.01)),
    ("RightArm", 3, (-0.18, 0.05, 0.0)),
    ("RightForeArm", 17, (-0.28, 0.0, 0.0)),
    ("RightHand", 18, (-0.25, 0.0, 0.01)),
]
TIPS = [(5, (0, 0.18, 0.02)), (9, (0, -0.08, 0.15)), (13, (0, -0.08, 0.15)), (16, (0, 0, 0))]


def person() -> Skeleton:
    names, parents, offsets = zip(*JOINTS, strict=True)
    joints, arms = zip(*TIPS, strict=True)
    return Skeleton(names, parents, np.array(offsets, float), joints, np.array(arms, float))


def answer(frames: int, rate: float) -> ClipAnswer:
    """Smooth turns of every joint by up to a radian, with signs that jump, along a curved path."""
    rng = np.random.default_rng(7)
    skeleton = person()
    t = np.arange(frames) / rate
    phases = rng.uniform(0, 2 * np.pi, (len(skeleton), 3))
    turns = 0.6 * np.sin(2 * np.pi * t[:, None, None] + phases)
    signs = rng.choice([-1.0, 1.0], (frames, len(skeleton), 1))
    path = np.stack([0.3 * np.sin(t), 0.9 + 0.05 * np.cos(5 * t), 1.2 * t], axis=-1)
    offsets = skeleton.offsets * 1.07
    made = clips.assemble(skeleton, signs * quat.exp(turns), path, offsets, rate)
    return ClipAnswer(made, TRUST)


@pytest.fixture(scope="session")
def walk():
    return answer(frames=45, rate=29.97)


@pytest.fixture(scope="session")
def pose():
    return answer(frames=1, rate=30.0)
