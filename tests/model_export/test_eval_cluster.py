"""Tests of evaluation and other jobs on a Dask cluster: equal results despite lost workers."""

import contextlib
import re
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest
from clusters import started, wait_for
from minimal import TOML, small_clip, write_clips

import posefield
import posefield_train

pytestmark = pytest.mark.system

CLIPS = 5
MAIN = "from posefield.cli import main; main()"
# Jobs that leave a mark for each run, and one that kills its worker.
JOBS = """
import os, sys, time
from pathlib import Path
from posefield_train.parallel import dask_jobs as cluster
from posefield.common.errors import ClusterError

class Shared:
    def __init__(self, folder):
        self.folder = Path(folder)

    def __setstate__(self, state):
        self.__dict__ = state
        (self.folder / f"shared.{os.getpid()}.{time.monotonic_ns()}").touch()

def job(shared, number, deadly):
    (shared.folder / f"{number}.{os.getpid()}").touch()
    time.sleep(0.1)
    if number == deadly:
        os.kill(os.getpid(), 9)
    return number

def work(address, folder, deadly, count, patience):
    with cluster.connect(address, float(patience)) as jobs:
        arguments = ((number, int(deadly)) for number in range(int(count)))
        return list(jobs.run(job, arguments, (Shared(folder),)))

if __name__ == "__main__":
    try:
        print(sorted(work(*sys.argv[1:])) == list(range(int(sys.argv[4]))))
    except ClusterError as error:
        print(error)
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
    """Function that starts the jobs above in a process of their own, and the folder of marks."""
    script, marks = tmp_path / "jobs.py", tmp_path / "marks"
    script.write_text(textwrap.dedent(JOBS))
    marks.mkdir()

    with contextlib.ExitStack() as started:

        def start(deadly=-1, count=24, patience=60):
            words = [sys.executable, script, cluster.address, marks, deadly, count, patience]
            own = subprocess.Popen(list(map(str, words)), stdout=subprocess.PIPE, text=True)
            started.enter_context(own)
            started.callback(own.kill)
            return own

        yield start, marks


def ran(marks):
    """Numbers of the jobs that were started, one for each time."""
    return [int(mark.stem) for mark in marks.iterdir() if not mark.name.startswith("shared")]


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


def test_a_worker_that_dies_loses_no_job(cluster, jobs):
    start, marks = jobs
    running = start()
    wait_for(lambda: len(ran(marks)) >= 8)
    before = len(ran(marks))
    cluster.kill(0)
    said, _ = running.communicate()
    assert said == "True\n"
    # It died in the middle, and the other worker ran its jobs again.
    assert before < 24 < len(ran(marks)) and len(set(ran(marks))) == 24


def test_shared_arguments_are_sent_to_each_worker_once(cluster, jobs):
    start, marks = jobs
    said, _ = start().communicate()
    assert said == "True\n"
    workers = {worker.pid for worker in cluster.workers}
    read = [int(mark.name.split(".")[1]) for mark in marks.glob("shared.*")]
    assert {pid: read.count(pid) for pid in workers} == dict.fromkeys(workers, 1)


def test_the_last_worker_may_be_replaced(cluster, jobs):
    """Data and jobs are not lost with the workers that had them."""
    start, marks = jobs
    running = start()
    wait_for(lambda: len(ran(marks)) >= 8)
    for worker in (0, 1):
        cluster.kill(worker)
    cluster.add()
    assert running.communicate() == ("True\n", None)


def test_a_worker_that_joins_with_another_source_is_refused(cluster, jobs, tmp_path):
    start, marks = jobs
    for package in (posefield_train, posefield):
        shutil.copytree(Path(package.__file__).parent, tmp_path / "older" / package.__name__)
    with (tmp_path / "older" / "posefield" / "cli/crowd_files.py").open("a") as file:
        file.write("# one more line\n")
    running = start(count=1000)
    wait_for(lambda: len(ran(marks)) >= 8)
    cluster.add(path=str(tmp_path / "older"))
    said, _ = running.communicate()
    assert re.fullmatch(r"tcp://127.0.0.1:\d+: posefield source \w+, expected source \w+\n", said)


def test_without_workers_it_ends(cluster, jobs):
    start, marks = jobs
    running = start(patience=2)
    wait_for(lambda: len(ran(marks)) >= 8)
    for worker in (0, 1):
        cluster.kill(worker)
    said, _ = running.communicate()
    assert said == f"{cluster.address}: has had no workers for 2 s\n"


def test_without_a_scheduler_it_ends(cluster, jobs):
    start, marks = jobs
    running = start()
    wait_for(lambda: len(ran(marks)) >= 8)
    cluster.running[0].kill()
    said, _ = running.communicate()
    assert said == f"{cluster.address}: the scheduler has gone\n"


def test_a_job_that_kills_whoever_takes_it_up_ends(cluster, jobs):
    start, _ = jobs
    for _ in range(2):
        cluster.add()
    said, _ = start(deadly=5).communicate(timeout=60)
    assert said.startswith(f"{cluster.address}: workers died at the same job 4 times, the last was")


def test_an_unreachable_scheduler_is_said_and_nothing_written(recipe, tmp_path):
    address = "tcp://127.0.0.1:1"
    done, written = evaluate(recipe, tmp_path / "none.json", "--scheduler", address)
    assert (done.returncode, written) == (2, b"")
    assert done.stderr == f"posefield: {address}: no Dask scheduler answers within 10 s\n"
