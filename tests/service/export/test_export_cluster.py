"""Tests of exports on a Dask cluster: equal bytes despite lost workers."""

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import exporting
import pytest
from clusters import started, wait_for
from typer.testing import CliRunner

from posefield import cli

pytestmark = pytest.mark.system

CLIPS, CHUNK = 240, 4
POSEFIELD = Path(sys.executable).parent / "posefield"
MAIN = "from posefield.cli import main; main()"
# Workers lack the version that is here.
OTHER = f"from posefield.common import dask_cluster as d; d.version = lambda name: '0'; {MAIN}"


@pytest.fixture(scope="module")
def words(model_path):
    """Function that gives the words of an export to a target."""

    def of(target, *more):
        sample = ("--sample", CLIPS, "--seed", 3, "--format", "usda", "--chunk", CHUNK)
        return [*map(str, ("export", model_path, *sample, "-o", target, *more))]

    return of


@pytest.fixture(scope="module")
def undisturbed(words, tmp_path_factory):
    """Content of the export, by path, done by one process."""
    target = tmp_path_factory.mktemp("undisturbed")
    assert CliRunner().invoke(cli.app, words(target, "--workers", 1)).exit_code == 0
    return exporting.content(target)


@pytest.fixture
def cluster(tmp_path):
    with started(tmp_path, 2) as own:
        yield own


def parts(target):
    folder = target / ".posefield/parts"
    return len(list(folder.iterdir())) if folder.exists() else 0


@pytest.fixture
def begun(words, cluster, tmp_path):
    """An export on the cluster that is at work, and its target."""
    target = tmp_path / "made"
    command = [POSEFIELD, *words(target, "--scheduler", cluster.address)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    with subprocess.Popen(command, **pipes) as process:
        wait_for(lambda: parts(target) >= 6 or process.poll() is not None)
        assert process.poll() is None, process.communicate()
        yield process, target
        process.kill()


def test_a_worker_killed_in_the_middle_loses_nothing(undisturbed, cluster, begun):
    process, target = begun
    cluster.kill(0)
    # Negative control: it was the middle.
    assert parts(target) < CLIPS // CHUNK
    said, _ = process.communicate(timeout=120)
    assert process.returncode == 0 and f"{CLIPS} clips" in said
    assert exporting.content(target) == undisturbed


@pytest.mark.parametrize("dies", ["client", "scheduler"])
def test_an_export_that_ends_early_is_resumed(words, undisturbed, cluster, begun, dies):
    process, target = begun
    if dies == "client":
        process.send_signal(signal.SIGINT)
    else:
        os.kill(cluster.running[0].pid, signal.SIGKILL)
    said, _ = process.communicate(timeout=120)
    if dies == "client":
        assert process.returncode == 128 + signal.SIGINT
        assert "the same command resumes" in said
    else:
        assert process.returncode == 2
        assert f"{cluster.address}: the scheduler has gone; finished chunks are kept" in said
    assert CliRunner().invoke(cli.app, words(target, "--workers", 1)).exit_code == 0
    assert exporting.content(target) == undisturbed


def test_workers_of_another_version_are_refused(words, cluster, tmp_path):
    asked = words(tmp_path / "made", "--scheduler", cluster.address)
    command = [sys.executable, "-c", OTHER, *asked]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert re.search(r"posefield: tcp://\S+: posefield \S+, expected 0; finished", done.stderr)
