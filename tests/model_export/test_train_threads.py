"""One and the same file however many threads the machine's linear algebra would take."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from minimal import small_clip, write_clips

RECIPE = """\
schema = 1
name = "tiny"
description = "Small motions"
licence = "CC0-1.0"
source = {{ metres_per_unit = 1.0, up = "y" }}
clips = {{ table = "clips.csv", file = "file" }}
controls = [{{ name = "speed", column = "v", unit = "m/s", description = "Mean speed" }}]
motion = {{ frames = {frames}, cyclic = false, root = "travelling" }}
alignment = {{ rounds = 1 }}
size = {{ rms_budget_cm = 0.1 }}
"""


RUN = "from service.cli import main; main()"


@pytest.fixture
def content(tmp_path):
    """Function that trains in a process of its own; gives the file's content."""
    # More clips than fit into one block of a matrix product, so that threads would share it.
    clips = [small_clip(0.3 * i % 2.0, 21 + i % 5) for i in range(40)]
    folder = write_clips(tmp_path / "data", clips)

    def of(threads: int, frames: int = 60) -> bytes:
        recipe, path = folder / "recipe.toml", Path(tmp_path / f"{threads}-{frames}.onnx")
        recipe.write_text(RECIPE.format(frames=frames))
        names = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
        own = {**os.environ, **dict.fromkeys(names, str(threads))}
        words = [sys.executable, "-c", RUN, "train", recipe, "-o", path]
        subprocess.run(words, env=own, check=True, capture_output=True)
        return path.read_bytes()

    return of


def test_threads_do_not_change_a_byte(content):
    one = content(1)
    assert content(2) == one
    assert content(1, frames=61) != one
