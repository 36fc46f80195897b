"""Tests of reproducible training: in any number of threads and processes, stopped or not."""

import os
import re
import subprocess
import sys
import time

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
def training(reaching_folder, tmp_path):
    """Function that starts a training of thirty clips at eight frames in a process of its own."""
    text = (reaching_folder / "recipe.toml").read_text()
    text = re.sub(r'(?s)(\[\[controls\]\]\nname = "stature"|\[presets\.).*?\n\n', "", text)
    text = text.replace("frames = 100", "frames = 8").replace("[size]", f"{SHORT}[size]")
    recipe = tmp_path / "recipe.toml"
    recipe.write_text(text)

    def started(path, threads: int, *more) -> subprocess.Popen:
        names = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
        own = {**os.environ, **dict.fromkeys(names, str(threads))}
        words = [sys.executable, "-c", RUN, "train", recipe, "--data", reaching_folder, "-o", path]
        return subprocess.Popen([*map(str, [*words, *more])], env=own, stderr=subprocess.PIPE)

    return started


@pytest.fixture
def content(training, tmp_path):
    """Function that returns the file of a training that runs to its end."""

    def of(threads: int, *more) -> bytes:
        path = tmp_path / "made.onnx"
        process = training(path, threads, *more)
        _, said = process.communicate()
        assert process.returncode == 0, said.decode()
        return path.read_bytes()

    return of


def test_threads_do_not_change_a_byte(content):
    """On two cores these very files differ where training does not keep to one thread."""
    assert content(2) == content(1)


def test_processes_do_not_change_a_byte(content):
    assert content(1, "--jobs", 2) == content(1)


def test_a_stopped_training_goes_on_with_its_finished_parts(training, content, tmp_path):
    kept, path = tmp_path / "kept", tmp_path / "stopped.onnx"
    stopped = training(path, 1, "--resume", kept)
    while stopped.poll() is None and not results(kept):
        time.sleep(0.01)
    stopped.kill()
    stopped.communicate()
    assert stopped.returncode != 0
    assert not path.exists()
    finished = results(kept)
    assert finished
    whole = content(1)
    assert content(1, "--resume", kept) == whole
    # The parts that were finished were read, and a third run computes none.
    again = results(kept)
    assert finished.items() <= again.items()
    assert len(again) > len(finished)
    assert content(1, "--resume", kept) == whole
    assert results(kept) == again


def results(folder):
    """Return the time at which each kept result was written."""
    return {file.name: file.stat().st_mtime_ns for file in folder.glob("*.result")}
