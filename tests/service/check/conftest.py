"""Fixture of the checker's tests: a valid file of a small hand-made clip."""

import numpy as np
import pytest
from pxr import Sdf

from posefield.encode.formats import CLIP_ENCODERS
from posefield.motion import clip, quat
from posefield.motion.skeleton import Skeleton
from posefield.question.results import ClipAnswer, Trust

SKELETON = Skeleton(
    ("Hips", "Spine", "Head", "LeftLeg", "LeftFoot", "RightLeg"),
    (-1, 0, 1, 0, 3, 0),
    np.array([(0, 1, 0), (0, 0.3, 0), (0, 0.3, 0), (0.1, 0, 0), (0, -0.9, 0), (-0.1, 0, 0)]),
    (2, 5),
    np.array([(0, 0.2, 0), (0, -0.9, 0.0)]),
)


@pytest.fixture(scope="session")
def answer():
    t = np.arange(8) / 30
    turns = 0.5 * np.sin(9 * t[:, None, None] + np.arange(18).reshape(6, 3))
    path = np.stack([0 * t, 1 + 0 * t, t], axis=-1)
    made = clip.assemble(SKELETON, quat.exp(turns), path, SKELETON.offsets, 30.0)
    return ClipAnswer(made, Trust("m@1", {"speed": 1.0}, 1.0, 0.01, ()))


@pytest.fixture(params=["usda", "usdc", "usdz"])
def good(request, answer, tmp_path):
    path = tmp_path / f"good.{request.param}"
    path.write_bytes(CLIP_ENCODERS[request.param].encode(answer))
    return path


@pytest.fixture
def layer(answer, tmp_path):
    """Layer of a good file, in which a test breaks something and saves it."""
    path = tmp_path / "damaged.usda"
    path.write_bytes(CLIP_ENCODERS["usda"].encode(answer))
    return Sdf.Layer.FindOrOpen(str(path))
