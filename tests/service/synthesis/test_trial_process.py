"""Tests of the trial of model files in a child process with limits on time and memory."""

import os
import signal
import threading
import time
from multiprocessing import resource_tracker
from pathlib import Path

import model_files
import onnx
import pytest

from posefield.common.errors import ModelError
from posefield.inference import session
from posefield.inference.trial_process import DEFAULT_LIMITS, TrialLimits
from posefield.model_file import checked_file

LONG = TrialLimits(cpu=600, wall=600.0)


@pytest.fixture(scope="module")
def content(labelled_path):
    return labelled_path.read_bytes()


@pytest.fixture(params=["forked", pytest.param("spawned", marks=pytest.mark.system)])
def way(request):
    """In a process without other threads, and beside one."""
    if request.param == "forked":
        yield
        return
    ended = threading.Event()
    other = threading.Thread(target=ended.wait)
    other.start()
    yield
    ended.set()
    other.join()


def refusal(content, limits=DEFAULT_LIMITS):
    with pytest.raises(ModelError) as caught:
        limits.check(content, "bad.onnx")
    assert caught.value.path == "bad.onnx" and "\n" not in caught.value.message
    return caught.value.message


def children():
    """Processes that this one has started and not yet waited for."""
    found = Path(f"/proc/self/task/{threading.get_native_id()}/children")
    return {int(word) for word in found.read_text().split()}


def open_files():
    return len([*Path("/proc/self/fd").iterdir()])


@pytest.fixture(autouse=True)
def nothing_is_left():
    # multiprocessing keeps one process of its own, once it has spawned another.
    resource_tracker.ensure_running()
    before, descriptors = children(), open_files()
    yield
    assert children() == before
    assert open_files() == descriptors


@pytest.mark.usefixtures("way")
def test_a_good_file_passes(content):
    assert DEFAULT_LIMITS.check(content, "good.onnx") is None


@pytest.mark.usefixtures("way")
@pytest.mark.parametrize(
    ("hostile", "said"),
    [
        (model_files.slow, "takes more than 1 s of CPU time to open"),
        (model_files.large, "takes more than 512 MB of memory to open"),
    ],
)
def test_a_hostile_file_is_refused(content, hostile, said):
    assert refusal(hostile(content), TrialLimits(cpu=1)) == said


def test_a_file_that_takes_too_long_by_the_clock_is_refused(content):
    """Of a process that does not compute, CPU time says nothing."""
    limits = TrialLimits(cpu=600, wall=0.5)
    assert refusal(model_files.slow(content), limits) == "was not open after 0.5 s"


def test_a_file_that_was_tried_is_not_tried_again(content):
    small = model_files.large(content, numbers=50_000_000)
    tried = frozenset([checked_file.digest(small)])
    assert TrialLimits(memory=100 << 20, passed=tried).check(small, "good.onnx") is None
    refusal(small, TrialLimits(memory=100 << 20, passed=frozenset(["0" * 16])))


@pytest.mark.system
@pytest.mark.parametrize("seconds", [0.0, 2.0])
def test_a_file_that_kills_the_process_is_refused(content, seconds):
    """Before it has read the file, or while it opens it."""
    before, found = children(), []
    slow = model_files.slow(content)
    trying = threading.Thread(target=lambda: found.append(refusal(slow, LONG)))
    trying.start()
    while not (started := [one for one in _of(trying) - before if "trial" in _name(one)]):
        time.sleep(0.01)
    (child,) = started
    time.sleep(seconds)
    os.kill(child, signal.SIGSEGV)
    trying.join()
    assert found == ["ended the process that opened it by SIGSEGV"]


def _of(thread):
    path = Path(f"/proc/self/task/{thread.native_id}/children")
    return {int(word) for word in path.read_text().split()}


def _name(process):
    """Return `trial` for a spawned process, else its command."""
    line = Path(f"/proc/{process}/cmdline").read_bytes().decode()
    return "trial" if "spawn_main" in line else line


@pytest.mark.usefixtures("way")
def test_a_graph_that_onnxruntime_refuses_is_told_in_its_words(content):
    model = onnx.load_from_string(content)
    del model.graph.node[5]
    assert refusal(model_files.written(model)).startswith("onnxruntime cannot load it: ")


def test_the_limits_are_of_the_child_alone(content):
    import resource

    before = [resource.getrlimit(kind) for kind in (resource.RLIMIT_CPU, resource.RLIMIT_AS)]
    DEFAULT_LIMITS.check(content, "good.onnx")
    after = [resource.getrlimit(kind) for kind in (resource.RLIMIT_CPU, resource.RLIMIT_AS)]
    assert before == after


def test_a_session_is_opened_only_after_the_trial(content, tmp_path):
    path = tmp_path / "bad.onnx"
    path.write_bytes(model_files.large(content))
    with pytest.raises(ModelError, match="takes more than 512 MB of memory to open"):
        session.load(path)
