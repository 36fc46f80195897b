"""Tests of reproducible training: the file does not depend on the number of BLAS threads."""

import os
import re
import subprocess
import sys

import pytest

pytestmark = pytest.mark.system

RUN = "from posefield.cli import main; main()"
SHORT = """\
[clips.where]
performer = { among = ["tall"] }

[alignment]
rounds = 0

[kriging]
covariance = "matern52"
drift = 1

"""


@pytest.fixture
def content(reaching_folder, tmp_path):
    """Function that trains thirty clips at eight frames in a process of its own."""
    text = (reaching_folder / "recipe.toml").read_text()
    text = re.sub(r'(?s)(\[\[controls\]\]\nname = "stature"|\[presets\.).*?\n\n', "", text)
    text = text.replace("frames = 100", "frames = 8").replace("[size]", f"{SHORT}[size]")
    recipe = tmp_path / "recipe.toml"
    recipe.write_text(text)

    def of(threads: int) -> bytes:
        path = tmp_path / f"{threads}.onnx"
        names = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
        own = {**os.environ, **dict.fromkeys(names, str(threads))}
        words = [sys.executable, "-c", RUN, "train", recipe]
        words += ["--data", reaching_folder, "-o", path]
        subprocess.run(words, env=own, check=True, capture_output=True)
        return path.read_bytes()

    return of


def test_threads_do_not_change_a_byte(content):
    """On two cores these very files differ where training does not keep to one thread."""
    assert content(2) == content(1)
