"""Test of a process's first layers from several threads at once."""

import subprocess
import sys

import pytest

pytestmark = pytest.mark.system

# Half of such processes hung for ever where nothing had made a layer before.
FIRST = """
import sys, threading
from pxr import Sdf
import posefield.encode.{module}
ready = threading.Barrier(6)
def make():
    ready.wait()
    for _ in range(5):
        Sdf.Layer.CreateAnonymous("clip.usda").ExportToString()
threads = [threading.Thread(target=make, daemon=True) for _ in range(6)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join(20.0)
    if thread.is_alive():
        sys.exit("hangs")
"""


MODULES = ("usd_clip", "usd_library", "crowd_scene")


@pytest.mark.parametrize("module", MODULES)
def test_threads_do_not_wait_for_each_other(module):
    words = [sys.executable, "-c", FIRST.format(module=module)]
    for _ in range(4):
        assert subprocess.run(words, check=False).returncode == 0
