"""Fixtures of the add-on's tests without Blender: import path and misbehaving servers."""

import contextlib
import sys
from pathlib import Path

import pytest
from misbehaving import Scripted

ROOT = Path(__file__).parents[3]
ADDON = ROOT / "clients/blender/addon"
sys.path[:0] = [str(ADDON), str(ADDON.parent)]


@pytest.fixture
def scripted():
    """Function that starts a server which answers every request with the same pieces of bytes."""
    with contextlib.ExitStack() as ending:

        def start(*pieces, pause=0.0):
            server = Scripted(pieces, pause)
            ending.callback(server.close)
            return server

        yield start
