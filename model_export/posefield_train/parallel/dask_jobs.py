"""Jobs on a Dask cluster, by the public interface of `distributed`.

The shared arguments are the result of a task, not scattered: scattered data are lost with the last
worker that holds them, a task runs again.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from typing import Any

import dask
from distributed import CancelledError, Client, Future, KilledWorker, get_worker, wait
from distributed.comm import CommClosedError

from posefield.common import dask_scheduler
from posefield.common.errors import ClusterError
from posefield_train.parallel.jobs import Arguments

KIT = dask_scheduler.RequiredSoftware(
    ("posefield", "posefield_train"),
    ("numpy", "scipy", "onnx", "onnxruntime", "pydantic", "scikit-learn"),
)
"""Packages whose versions determine a result."""
QUEUED_PER_THREAD = 2
"""Jobs submitted per thread of the workers, so that a worker need not wait for its next one."""
POLL_SECONDS = 1.0
"""Seconds without a finished job after which the workers are counted."""
WORKER_TIMEOUT = 60.0
"""Seconds without any worker, or for fetching one result."""


@dataclass(frozen=True)
class DaskJobs:
    """Workers of a Dask scheduler. patience: seconds without any worker until ClusterError."""

    client: Client
    address: str
    timeout: float = WORKER_TIMEOUT

    def run(
        self,
        function: Callable[..., Any],
        arguments: Iterable[Arguments],
        shared: Arguments = (),
    ) -> Iterator[Any]:
        """Run jobs as `Jobs.run` does. A job whose worker dies runs again on another.

        Raises ClusterError if a job killed every worker that ran it, if no worker is left, if the
        scheduler stops, and if a worker that joined later has other packages.
        """
        given = _SharedJob(function, shared, dask_scheduler.installed_versions(KIT))
        waiting = iter(arguments)
        with _cluster_errors(self.address):
            data = self.client.submit(_identity, given, pure=False)
            running = self._submit(data, islice(waiting, self._free_slots(0)))
            while running:
                for future in self._wait(running):
                    yield from self._fetch(future, running)
                running |= self._submit(data, islice(waiting, self._free_slots(len(running))))

    def _free_slots(self, running: int) -> int:
        """Return the number of jobs to submit.

        At least one thread is assumed, because a worker can connect later.
        """
        threads = sum(self.client.nthreads().values())
        return max(QUEUED_PER_THREAD * max(threads, 1) - running, 0)

    def _submit(self, data: Future, arguments: Iterable[Arguments]) -> set[Future]:
        return {self.client.submit(_run_job, data, own, pure=False) for own in arguments}

    def _wait(self, running: set[Future]) -> set[Future]:
        """Return the futures of finished jobs; empty if none finishes within POLL."""
        try:
            with self.client.as_current():
                return set(wait(running, timeout=POLL_SECONDS, return_when="FIRST_COMPLETED").done)
        except TimeoutError:
            self._expect_workers()
            return set()

    def _fetch(self, future: Future, running: set[Future]) -> Iterator[Any]:
        """Yield a job's result; nothing if it was lost with its worker, and the job runs again."""
        try:
            result = future.result(timeout=self.timeout)
        except TimeoutError:
            if future.status == "error":
                raise
            self._expect_workers()
        else:
            running.remove(future)
            yield result

    def _expect_workers(self) -> None:
        try:
            self.client.wait_for_workers(1, timeout=self.timeout)
        except TimeoutError as error:
            message = f"has had no workers for {self.timeout:g} s"
            raise ClusterError(self.address, message) from error


@contextmanager
def connect(address: str, patience: float = WORKER_TIMEOUT) -> Iterator[DaskJobs]:
    """Connect to the scheduler at an address such as tcp://host:8786.

    Raises ClusterError if it cannot be used.
    """
    # The size of a job's arguments is known; the warning is meant for authors of Dask programs.
    quiet = {"distributed.admin.large-graph-warning-threshold": "1 TiB"}
    with dask.config.set(quiet), dask_scheduler.connect(address, KIT) as client:
        yield DaskJobs(client, address, patience)


@dataclass(frozen=True)
class _SharedJob:
    """Common part of the jobs of a run. kit: versions that every worker must have."""

    function: Callable[..., Any]
    shared: Arguments
    kit: Mapping[str, str]


def _identity(given: _SharedJob) -> _SharedJob:
    return given


def _run_job(given: _SharedJob, own: Arguments) -> Any:
    # Workers that joined later have not been checked.
    if unlike := dask_scheduler.describe_differences(
        dask_scheduler.installed_versions(KIT), given.kit
    ):
        raise ClusterError(get_worker().address, unlike)
    return given.function(*given.shared, *own)


@contextmanager
def _cluster_errors(address: str) -> Iterator[None]:
    """Raise the errors of Dask as ClusterError."""
    try:
        yield
    except KilledWorker as error:
        raise ClusterError(address, dask_scheduler.killed_message(error)) from error
    except (CancelledError, CommClosedError) as error:
        raise ClusterError(address, "the scheduler has gone") from error
