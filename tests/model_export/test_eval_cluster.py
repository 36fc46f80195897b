"""Tests of evaluation on a Dask cluster: equal results."""

import subprocess
import sys

import numpy as np
import pytest
from clusters import started
from minimal import TOML, small_clip, write_clips

pytestmark = pytest.mark.system

CLIPS = 5
MAIN = "from posefield.cli import main; main()"


@pytest.fixture(scope="module")
def recipe(tmp_path_factory):
    """A recipe beside its small clips."""
    rng = np.random.Generator(np.random.PCG64(3))
    clips = [small_clip(0.4 * i + 0.02 * rng.standard_normal(), 21 + i) for i in range(CLIPS)]
    path = write_clips(tmp_path_factory.mktemp("cluster") / "small", clips) / "recipe.toml"
    path.write_text(TOML)
    return path


@pytest.fixture
def cluster(tmp_path):
    with started(tmp_path, 2) as own:
        yield own


def evaluate(recipe, output, *words):
    """Run the command; return its process and file."""
    own = [sys.executable, "-c", MAIN, "evaluate", recipe, "--json", output, *words]
    done = subprocess.run(own, capture_output=True, text=True, check=False)
    return done, output.read_bytes() if output.exists() else b""


def test_a_cluster_measures_what_one_machine_measures(recipe, cluster, tmp_path):
    here, found = evaluate(recipe, tmp_path / "here.json")
    there, same = evaluate(recipe, tmp_path / "there.json", "--scheduler", cluster.address)
    assert (here.returncode, there.returncode) == (0, 0), there.stderr
    assert there.stdout == here.stdout and "| posefield" in here.stdout
    assert same == found != b""
    # It was done there: every worker of the two has run some of it.
    assert cluster.log.read_text().count("Starting established connection") >= 2


def test_an_unreachable_scheduler_is_said_and_nothing_written(recipe, tmp_path):
    address = "tcp://127.0.0.1:1"
    done, written = evaluate(recipe, tmp_path / "none.json", "--scheduler", address)
    assert (done.returncode, written) == (2, b"")
    assert (
        done.stderr
        == f"posefield: {address}: no Dask scheduler answers within 10 s, expected tcp://HOST:PORT\n"
    )
