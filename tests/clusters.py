"""Dask scheduler and workers as separate processes, as on a cluster."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

# Seconds that processes have to start in.
PATIENCE = 60.0


@dataclass
class Cluster:
    """address: of the scheduler. workers: processes without a nanny, so that a death is final."""

    address: str
    log: Path
    running: list[subprocess.Popen[bytes]]

    @property
    def workers(self) -> list[subprocess.Popen[bytes]]:
        """The first that runs is the scheduler."""
        return self.running[1:]

    def add(self, threads: int = 1, python: str = sys.executable, path: str = "") -> None:
        """Start one more worker, of a Python; path: where it looks for modules first."""
        words = [python, "-m", "distributed.cli.dask_worker", self.address, "--no-nanny"]
        words += ["--no-dashboard", "--death-timeout", "20", "--nthreads", str(threads)]
        own = {**os.environ, "PYTHONPATH": path}
        with self.log.open("ab") as log:
            # In a folder of its own: a module run by -m looks around itself first.
            started = subprocess.Popen(words, stdout=log, stderr=log, env=own, cwd=self.log.parent)
        self.running.append(started)
        wait_for(lambda: self.log.read_text().count("Registered to:") == len(self.workers))

    def kill(self, worker: int) -> None:
        """SIGKILL: nothing is said, nothing is finished."""
        os.kill(self.workers[worker].pid, signal.SIGKILL)
        self.workers[worker].wait()


@contextmanager
def started(folder: Path, workers: int) -> Iterator[Cluster]:
    """A scheduler with that many workers, all gone afterwards."""
    said, log = folder / "scheduler.json", folder / "cluster.log"
    words = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", said]
    own = [sys.executable, "-m", "distributed.cli.dask_scheduler", *map(str, words)]
    with log.open("ab") as out:
        running = [subprocess.Popen(own, stdout=out, stderr=out)]
    try:
        wait_for(lambda: said.exists() and said.stat().st_size > 0)
        cluster = Cluster(json.loads(said.read_text())["address"], log, running)
        for _ in range(workers):
            cluster.add()
        yield cluster
    finally:
        _end(running)


def wait_for(true, seconds: float = PATIENCE) -> None:
    """Until it is true; TimeoutError where it does not become so."""
    end = time.monotonic() + seconds
    while not true():
        if time.monotonic() > end:
            raise TimeoutError
        time.sleep(0.02)


def _end(processes: Sequence[subprocess.Popen[bytes]]) -> None:
    for process in processes:
        process.kill()
    for process in processes:
        process.wait()
