"""Evaluation and other jobs on a Dask cluster: the same answers, whoever dies on the way."""

import subprocess
import sys
import textwrap

import numpy as np
import pytest
from clusters import started, wait_for
from minimal import TOML, small_clip, write_clips

CLIPS = 5
MAIN = "from service.cli import main; main()"
# A job of joblib's that leaves a mark wherever it ran, and dies where it is told to.
JOBS = """
import os, sys, time
from pathlib import Path
from joblib import Parallel, delayed
from model_export import cluster
from service.motion.errors import ClusterError

def job(shared, number, marks, deadly):
    Path(marks, f"{number}.{os.getpid()}").touch()
    time.sleep(0.1)
    if number == deadly:
        os.kill(os.getpid(), 9)
    return number * shared[0]

if __name__ == "__main__":
    address, marks, deadly = sys.argv[1:]
    shared = [7]
    try:
        with cluster.jobs(address, [shared]):
            jobs = [delayed(job)(shared, number, marks, int(deadly)) for number in range(24)]
            found = list(Parallel(return_as="generator_unordered")(jobs))
        print(sorted(found) == [7 * number for number in range(24)])
    except ClusterError as fault:
        print(fault)
"""


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


@pytest.fixture
def jobs(cluster, tmp_path):
    """Function that begins the jobs above in a process of its own, and where their marks are."""
    script, marks = tmp_path / "jobs.py", tmp_path / "marks"
    script.write_text(textwrap.dedent(JOBS))
    marks.mkdir()

    def begin(deadly):
        words = [sys.executable, script, cluster.address, marks, str(deadly)]
        return subprocess.Popen(words, stdout=subprocess.PIPE, text=True)

    return begin, marks


def evaluate(recipe, output, *words):
    """What the command says and writes."""
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


def test_a_worker_that_dies_loses_no_job(cluster, jobs):
    begin, marks = jobs
    running = begin(deadly=-1)
    wait_for(lambda: len(list(marks.iterdir())) >= 8)
    before = len(list(marks.iterdir()))
    cluster.kill(0)
    said, _ = running.communicate()
    assert said == "True\n"
    # It died in the middle, and its work was done again by the other.
    ran = [mark.stem for mark in marks.iterdir()]
    assert before < 24 < len(ran) and len(set(ran)) == 24


def test_a_job_that_kills_whoever_takes_it_up_ends(cluster, jobs):
    begin, _ = jobs
    for _ in range(2):
        cluster.add()
    said, _ = begin(deadly=5).communicate(timeout=60)
    assert said.startswith(f"{cluster.address}: workers died at the same job 4 times, the last was")


def test_an_unreachable_scheduler_is_said_and_nothing_written(recipe, tmp_path):
    address = "tcp://127.0.0.1:1"
    done, written = evaluate(recipe, tmp_path / "none.json", "--scheduler", address)
    assert (done.returncode, written) == (2, b"")
    assert done.stderr == f"posefield: {address}: no Dask scheduler answers within 10 s\n"


def test_table_1_is_timed_here_only(recipe, tmp_path):
    done, _ = evaluate(recipe, tmp_path / "none.json", "--table1", "--scheduler", "tcp://a:1")
    assert done.returncode == 2
    assert "Table 1 is timed on one machine" in done.stderr
