"""A real service for the client to ask, and servers that misbehave."""

import shutil
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
sys.path.insert(0, str(ROOT / "tests/contract"))


@pytest.fixture(scope="session")
def models(labelled_path, walk_path, tmp_path_factory) -> Path:
    """Folder with the models that the examples ask: one that knows performers, one of a gait."""
    folder = tmp_path_factory.mktemp("models")
    shutil.copy(labelled_path, folder / "reach.onnx")
    shutil.copy(walk_path, folder / "walk.onnx")
    return folder


@pytest.fixture(scope="module")
def address(models):
    """Where a service listens that is a process of its own, which is killed after 90 seconds."""
    import serving

    with serving.process(models) as child:
        yield serving.address(child)


@pytest.fixture(scope="session")
def controls() -> dict[str, float]:
    """Controls in the midst of what was sampled."""
    return {"stature": 1.72, "hip_height": 0.9, "turn": 20, "target_height": 1.1}
