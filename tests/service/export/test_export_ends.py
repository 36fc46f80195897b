"""Tests of exports that are killed, interrupted or out of space: complete files, and a rerun.

Each export runs as a process of its own, by the user's command.
"""

import contextlib
import os
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import exporting
import pytest
from typer.testing import CliRunner

from posefield import cli

pytestmark = pytest.mark.system

CLIPS, CHUNK = 600, 4
POSEFIELD = Path(sys.executable).parent / "posefield"
PARTS = ".posefield/parts"


@pytest.fixture(scope="module")
def command(model_path):
    """Words of a command that exports to a target; about a second's work."""

    def words(target, *more):
        sample = ("--sample", str(CLIPS), "--seed", "3", "--format", "json", "--fps", "60")
        chunk = ("--chunk", str(CHUNK), "-o", str(target))
        return [str(POSEFIELD), "export", str(model_path), *sample, *chunk, *map(str, more)]

    return words


@pytest.fixture(scope="module")
def undisturbed(command, tmp_path_factory):
    """Content of the export, by path, done by one process."""
    target = tmp_path_factory.mktemp("undisturbed")
    subprocess.run(command(target, "--workers", 1), check=True, capture_output=True)
    return exporting.content(target)


def begun(words, **more):
    """The command as a process, and the leader of a group of its own."""
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen(words, start_new_session=True, **pipes, **more)


def parts(target):
    folder = target / PARTS
    return len(list(folder.iterdir())) if folder.exists() else 0


def reached(target, number, process):
    """Wait until so many chunks are done; whether the process is still at work then."""
    while parts(target) < number and process.poll() is None:
        time.sleep(0.001)
    return process.poll() is None


def workers_of(process):
    """Process ids of the workers of an export; a child may end while they are listed."""
    workers = []
    for child in Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split():
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):
            if b"spawn_main" in Path(f"/proc/{child}/cmdline").read_bytes():
                workers.append(int(child))
    return workers


def whole(target, undisturbed):
    """Number of clips in a target, each of which is as it should be."""
    found = exporting.content(target / "clips")
    assert all(undisturbed[f"clips/{path}"] == content for path, content in found.items())
    return len(found)


def go_on(words):
    """The rest of an export by the same command, in this process."""
    done = CliRunner().invoke(cli.app, [*words[1:], "--workers", "1"])
    assert done.exit_code == 0, done.output


def test_killed_ten_times_it_ends_with_the_same_bytes(command, undisturbed, tmp_path):
    chance, killed = random.Random(5), 0
    while killed < 10:
        process = begun(command(tmp_path, "--workers", 1 + killed % 2))
        if reached(tmp_path, parts(tmp_path) + chance.randrange(1, 5), process):
            time.sleep(chance.uniform(0.0, 0.01))
            # The parent alone, whose workers must end by themselves, or all at once.
            kill = os.kill if killed % 4 == 1 else os.killpg
            kill(process.pid, signal.SIGKILL)
        process.communicate()
        killed += process.returncode == -signal.SIGKILL
        whole(tmp_path, undisturbed)
        if process.returncode == 0:
            # A busy machine looked too late: what went on to the end is seen to, and begun again.
            assert exporting.content(tmp_path) == undisturbed
            shutil.rmtree(tmp_path)
    assert not (tmp_path / "manifest.jsonl").exists()
    go_on(command(tmp_path))
    assert exporting.content(tmp_path) == undisturbed


def test_a_killed_blend_space_is_in_no_part_there_and_ends_with_the_same_bytes(tmp_path):
    def bake(folder):
        grid = ("--grid", "speed=0.6:1.7:12", "--grid", "turn=-4:20:10", "--workers", "1")
        return [str(POSEFIELD), "bake", "cmu_walk", *grid, "-o", str(tmp_path / folder)]

    process = begun(bake("killed"))
    while not [*tmp_path.glob("killed/clips/*/*.glb")] and process.poll() is None:
        time.sleep(0.001)
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
    subprocess.run(bake("undisturbed"), check=True, capture_output=True)
    undisturbed = exporting.content(tmp_path / "undisturbed")
    assert 0 < whole(tmp_path / "killed", undisturbed) < 120
    assert not (tmp_path / "killed/blendspace.json").exists()
    go_on(bake("killed"))
    assert exporting.content(tmp_path / "killed") == undisturbed


@pytest.mark.parametrize("told", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize(("workers", "after"), [(1, 5), (2, 5), (2, 0)])
def test_told_to_stop_it_says_how_to_go_on(told, workers, after, command, undisturbed, tmp_path):
    process = begun(command(tmp_path, "--workers", workers))
    # After none, its workers have hardly begun.
    assert reached(tmp_path, after, process), process.communicate()
    while after == 0 and process.poll() is None and len(workers_of(process)) < 2:
        time.sleep(0.001)
    # As a terminal does: the whole group is told.
    os.killpg(process.pid, told)
    out, err = process.communicate(timeout=30)
    assert process.returncode == 128 + told, err
    done = CHUNK * parts(tmp_path)
    told_of = re.search(
        rf"stopped when (\d+) of {CLIPS} clips were finished; the same command resumes", out
    )
    # Each worker may have ended one more chunk after they were counted.
    assert told_of and done - workers * CHUNK <= int(told_of[1]) <= done, out
    assert "Traceback" not in err
    assert CLIPS > whole(tmp_path, undisturbed) >= done >= after
    assert not (tmp_path / "export.json").exists()
    go_on(command(tmp_path))
    assert exporting.content(tmp_path) == undisturbed


@pytest.mark.parametrize("after", [0, 5])
@pytest.mark.parametrize("place", [0, 1])
def test_a_worker_that_dies_ends_it_clearly(place, after, command, undisturbed, tmp_path):
    process = begun(command(tmp_path, "--workers", 2))
    assert reached(tmp_path, after, process), process.communicate()
    # After none, the worker is killed as it starts.
    while len(workers_of(process)) <= place:
        assert process.poll() is None
        time.sleep(0.001)
    os.kill(workers_of(process)[place], signal.SIGKILL)
    out, err = process.communicate(timeout=30)
    assert (process.returncode, out) == (5, ""), err
    last = err.strip().splitlines()[-1]
    assert last.startswith("posefield: a worker process has died; finished chunks are kept")
    assert "Traceback" not in err
    assert whole(tmp_path, undisturbed) < CLIPS
    go_on(command(tmp_path))
    assert exporting.content(tmp_path) == undisturbed


@pytest.mark.parametrize("workers", [1, 2])
def test_where_no_more_can_be_written_it_names_the_file(workers, command, undisturbed, tmp_path):
    """As on a full disk: the system writes a part of a file and refuses the rest."""
    sizes = [len(c) for path, c in sorted(undisturbed.items()) if path.startswith("clips")]
    room = max(sizes[:20])
    assert room < max(sizes)
    process = begun(
        command(tmp_path, "--workers", workers),
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (room, room)),
    )
    out, err = process.communicate(timeout=60)
    assert (process.returncode, out) == (3, "")
    last = err.strip().splitlines()[-1]
    assert last.startswith(f"posefield: {tmp_path}/clips/000/")
    assert last.endswith(".json: cannot be written or read: File too large")
    assert 0 < whole(tmp_path, undisturbed) < CLIPS
    go_on(command(tmp_path))
    assert exporting.content(tmp_path) == undisturbed
