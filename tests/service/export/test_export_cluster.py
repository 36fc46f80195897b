"""Tests of exports on a Dask cluster: equal bytes despite lost workers."""

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import exporting
import pytest
from clusters import started, wait_for
from typer.testing import CliRunner

import posefield
from posefield import cli

pytestmark = pytest.mark.system

CLIPS, CHUNK = 480, 4
POSEFIELD = Path(sys.executable).parent / "posefield"


@pytest.fixture(scope="module")
def words(model_path):
    """Function that gives a command which exports to a target."""

    def of(target, *more):
        sample = ("--sample", CLIPS, "--seed", 3, "--format", "usda", "--chunk", CHUNK)
        return [*map(str, (POSEFIELD, "export", model_path, *sample, "-o", target, *more))]

    return of


@pytest.fixture(scope="module")
def undisturbed(words, tmp_path_factory):
    """Content of the export, by path, done by one process."""
    target = tmp_path_factory.mktemp("undisturbed")
    subprocess.run(words(target, "--workers", 1), check=True, capture_output=True)
    return exporting.content(target)


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    """Yield two workers that tests must not harm."""
    with started(tmp_path_factory.mktemp("cluster"), 2) as own:
        yield own


@pytest.fixture
def mortal(tmp_path):
    """Two workers of a test's own."""
    with started(tmp_path, 2) as own:
        yield own


def parts(target):
    folder = target / ".posefield/parts"
    return len(list(folder.iterdir())) if folder.exists() else 0


def begun(command, target, number):
    """The command as a process, when so many chunks are done and it is still at work."""
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    process = subprocess.Popen(command, **pipes)
    wait_for(lambda: parts(target) >= number or process.poll() is not None)
    assert process.poll() is None, process.communicate()
    return process


def ended(process):
    """Exit code, and all that was said."""
    said, _ = process.communicate(timeout=120)
    return process.returncode, said


def go_on(command):
    """The rest of an export by the same command here."""
    done = CliRunner().invoke(cli.app, [*command[1:], "--workers", "1"])
    assert done.exit_code == 0, done.output


def test_a_cluster_makes_the_same_bytes(words, undisturbed, cluster, tmp_path):
    command = words(tmp_path / "made", "--scheduler", cluster.address)
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert f"{CLIPS} clips" in done.stdout
    assert exporting.content(tmp_path / "made") == undisturbed


def test_threads_of_one_worker_do_each_other_no_harm(words, undisturbed, tmp_path):
    with started(tmp_path, 0) as many:
        many.add(threads=4)
        command = words(tmp_path / "made", "--scheduler", many.address)
        subprocess.run(command, check=True, capture_output=True)
    assert exporting.content(tmp_path / "made") == undisturbed


def test_a_worker_killed_in_the_middle_loses_nothing(words, undisturbed, mortal, tmp_path):
    target = tmp_path / "made"
    process = begun(words(target, "--scheduler", mortal.address), target, 10)
    mortal.kill(0)
    done = parts(target)
    # Negative control: it was the middle.
    assert 10 <= done < CLIPS // CHUNK
    assert ended(process)[0] == 0
    assert exporting.content(target) == undisturbed


def test_workers_that_are_all_killed_are_waited_for(words, undisturbed, mortal, tmp_path):
    """The model's bytes went with them, and are given out anew."""
    target = tmp_path / "made"
    process = begun(words(target, "--scheduler", mortal.address), target, 10)
    mortal.kill(0)
    mortal.kill(1)
    done = parts(target)
    time.sleep(0.5)
    assert parts(target) == done < CLIPS // CHUNK and process.poll() is None
    mortal.add()
    assert ended(process)[0] == 0
    assert exporting.content(target) == undisturbed


def test_told_to_stop_its_workers_stop_too(words, undisturbed, cluster, tmp_path):
    target = tmp_path / "made"
    process = begun(words(target, "--scheduler", cluster.address), target, 10)
    process.send_signal(signal.SIGINT)
    code, said = ended(process)
    assert code == 128 + signal.SIGINT
    assert "the same command resumes" in said
    time.sleep(1.0)
    done = parts(target)
    time.sleep(1.0)
    assert parts(target) == done < CLIPS // CHUNK
    go_on(words(target))
    assert exporting.content(target) == undisturbed


def test_killed_it_leaves_workers_free_and_goes_on(words, undisturbed, cluster, tmp_path):
    target = tmp_path / "made"
    process = begun(words(target, "--scheduler", cluster.address), target, 10)
    process.kill()
    assert ended(process)[0] == -signal.SIGKILL
    subprocess.run(words(target, "--scheduler", cluster.address), check=True, capture_output=True)
    assert exporting.content(target) == undisturbed


def test_a_scheduler_that_dies_is_said(words, undisturbed, mortal, tmp_path):
    target = tmp_path / "made"
    process = begun(words(target, "--scheduler", mortal.address), target, 10)
    os.kill(mortal.running[0].pid, signal.SIGKILL)
    code, said = ended(process)
    assert code == 2
    assert f"posefield: {mortal.address}: the scheduler has gone; finished chunks are kept" in said
    go_on(words(target))
    assert exporting.content(target) == undisturbed


def test_a_worker_that_came_later_with_another_source_is_refused(words, mortal, tmp_path):
    copy = tmp_path / "older"
    shutil.copytree(Path(posefield.__file__).parent, copy / "posefield")
    with (copy / "posefield" / "cli/crowd_files.py").open("a") as file:
        file.write("# one more line\n")
    target = tmp_path / "made"
    process = begun(words(target, "--scheduler", mortal.address), target, 10)
    mortal.kill(0)
    mortal.kill(1)
    mortal.add(path=str(copy))
    code, said = ended(process)
    assert code == 2
    assert re.search(r"posefield: tcp://\S+: posefield source \w+, expected source \w+\n", said)


def test_a_chunk_that_takes_its_workers_with_it_ends_it(words, undisturbed, monkeypatch, tmp_path):
    # A chunk of ours takes no worker with it: here one death is enough to be blamed.
    monkeypatch.setenv("DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES", "0")
    target = tmp_path / "made"
    with started(tmp_path, 2) as cluster:
        process = begun(words(target, "--scheduler", cluster.address), target, 10)
        cluster.kill(0)
        code, said = ended(process)
    assert code == 2
    assert f"posefield: {cluster.address}: workers died at the same job 1 times" in said
    assert "out of memory? Finished chunks are kept, and the same command resumes" in said
    go_on(words(target))
    assert exporting.content(target) == undisturbed


# Asks for a chunk where nobody began an export: what a worker sees of a folder that is not shared.
UNSHARED = """
import sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
import exporting
from posefield.batch import dask_export as cluster
from posefield.batch.chunks import ChunkTask
from posefield.common.errors import FileError
source = exporting.queries(4)
work = exporting.work(Path(sys.argv[2]), source, sys.argv[3])
with cluster.runner(sys.argv[4]) as run:
    try:
        list(run(work, iter([ChunkTask(0, 0, tuple(source.rows()))]), lambda: False))
    except FileError as fault:
        print(fault)
"""


def test_a_folder_that_workers_do_not_share_is_refused(cluster, model_path, tmp_path):
    target = tmp_path / "made"
    here = [Path(exporting.__file__).parent, model_path, target, cluster.address]
    command = [sys.executable, "-c", UNSHARED, *map(str, here)]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert said.startswith(f"{target}: holds no export for worker tcp://127.0.0.1:")
    assert "expected a folder that all machines share" in said
    assert not target.exists()


def test_a_scheduler_has_workers_of_its_own(words, tmp_path):
    command = words(tmp_path / "made", "--scheduler", "tcp://127.0.0.1:1", "--workers", 2)
    done = CliRunner().invoke(cli.app, command[1:])
    assert "workers: 2, but a scheduler has its own" in str(done.exception)


def test_an_unreachable_scheduler_is_said_and_nothing_written(words, tmp_path):
    target = tmp_path / "made"
    command = words(target, "--scheduler", "tcp://127.0.0.1:1")
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr == "posefield: tcp://127.0.0.1:1: no Dask scheduler answers within 10 s\n"
    assert not target.exists()
