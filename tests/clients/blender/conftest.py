"""What of the add-on needs no Blender, a real service for it to ask, and servers that misbehave."""

import contextlib
import shutil
import sys
from pathlib import Path

import pytest
from misbehaving import Scripted

ROOT = Path(__file__).parents[3]
ADDON = ROOT / "clients/blender/posefield"
sys.path[:0] = [str(ADDON), str(ADDON.parent), str(ROOT / "tests/contract")]


@pytest.fixture(scope="session")
def models(labelled_path, walk_path, tmp_path_factory) -> Path:
    """Folder with the models that the examples ask: one that knows performers, one of a gait."""
    folder = tmp_path_factory.mktemp("models")
    shutil.copy(labelled_path, folder / "reach.onnx")
    shutil.copy(walk_path, folder / "walk.onnx")
    return folder


@pytest.fixture(scope="session")
def address(models):
    """Where a service listens that is a process of its own."""
    import serving

    with serving.process(models) as child:
        yield serving.address(child)


@pytest.fixture
def scripted():
    """Function that starts a server which answers every request with the same pieces of bytes."""
    with contextlib.ExitStack() as ending:

        def start(*pieces, pause=0.0):
            server = Scripted(pieces, pause)
            ending.callback(server.close)
            return server

        yield start
