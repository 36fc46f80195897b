"""Export on the workers of a Dask scheduler.

If a worker dies, Dask reassigns its chunks; a chunk made twice leaves the same files. The model's
bytes and the job are the result of a task of their own: scattered data is lost with its workers,
but a task is repeated.
"""

import time
import uuid
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from itertools import islice
from queue import Empty, SimpleQueue
from typing import Any

from distributed import Client, Future, get_worker
from distributed.client import FutureCancelledError
from distributed.comm import CommClosedError
from distributed.scheduler import KilledWorker

from posefield.batch import checkpoint, chunks
from posefield.batch.checkpoint import ChunkResult
from posefield.batch.chunks import ChunkAbandoned, ChunkTask, StopCheck
from posefield.batch.job import VERSIONED_PACKAGES, WorkerInput
from posefield.batch.process_pool import RESUMES, Runner
from posefield.batch.target import open_target
from posefield.common import dask_scheduler
from posefield.common.errors import ClusterError, FileError

KIT = dask_scheduler.RequiredSoftware(("posefield",), VERSIONED_PACKAGES)
"""Code and packages on which a chunk's bytes depend."""
CHUNKS_PER_THREAD = 3
"""Chunks submitted for each thread of the workers, so that none waits for the next."""
POLL_INTERVAL = 0.1
"""Seconds between two checks for a stop and for the number of workers."""
FETCH_INTERVAL = 5.0
"""Seconds until the result of a finished chunk is considered lost with its worker."""
NO_WORKERS_TIMEOUT = 60.0
"""Seconds without workers after which the export fails."""


@contextmanager
def runner(address: str) -> Iterator[Runner]:
    """Connect to the scheduler at an address such as tcp://host:8786, and yield the runner.

    Raises ClusterError if it cannot be used; the runner raises it if the scheduler ends, if there
    are no workers for a minute, or if one chunk has ended every worker that ran it.
    """
    with dask_scheduler.connect(address, KIT) as client:
        yield partial(_run_on_workers, client, address)


def _run_on_workers(
    client: Client, address: str, work: WorkerInput, tasks: Iterator[ChunkTask], stopped: StopCheck
) -> Iterator[ChunkResult]:
    with _cluster_errors(address):
        hands = _PendingChunks(client, address, _SharedWork.scatter(client, work))
        try:
            yield from hands.parts(tasks, stopped)
        finally:
            hands.cancel_all()


@dataclass(frozen=True)
class _SharedWork:
    """Data that every chunk needs. kit: packages and versions that a worker must have installed."""

    work: WorkerInput
    kit: Mapping[str, str]

    @classmethod
    def scatter(cls, client: Client, work: WorkerInput) -> Future:
        """Return a future of this data, which the workers keep as long as the future exists."""
        own = cls(work, dask_scheduler.installed_versions(KIT))
        return client.submit(_identity, own, key=f"posefield-{uuid.uuid4().hex}")


class _PendingChunks:
    """Chunks that are submitted and not yet collected."""

    def __init__(self, client: Client, address: str, given: Future) -> None:
        self._client, self._address, self._given = client, address, given
        self._run = uuid.uuid4().hex
        self._pending: set[Future] = set()
        self._ready: SimpleQueue[Future] = SimpleQueue()
        self._threads, self._counted = 0, -1.0

    def parts(self, tasks: Iterator[ChunkTask], stopped: StopCheck) -> Iterator[ChunkResult]:
        """Yield the parts of tasks in the order of completion."""
        while not stopped():
            for task in islice(tasks, max(self._free_slots(), 0)):
                self._submit(task)
            if not self._pending:
                return
            yield from self._collect()
        while not self._ready.empty():
            yield from self._collect()

    def cancel_all(self) -> None:
        """Cancel the submitted chunks; workers stop within a batch and record no part."""
        self._client.cancel([*self._pending, self._given])

    def _submit(self, task: ChunkTask) -> None:
        key = f"chunk-{task.number}-{self._run}"
        future = self._client.submit(_run_task, self._given, task, key=key)
        self._pending.add(future)
        future.add_done_callback(self._ready.put)

    def _collect(self) -> Iterator[ChunkResult]:
        try:
            future = self._ready.get(timeout=POLL_INTERVAL)
            part = future.result(timeout=FETCH_INTERVAL)
        except Empty:
            return
        except TimeoutError:
            # The worker died before the result was fetched: Dask repeats the chunk.
            future.add_done_callback(self._ready.put)
            return
        self._pending.discard(future)
        yield part

    def _free_slots(self) -> int:
        """Return how many more chunks to submit, by the present number of workers' threads."""
        now = time.monotonic()
        if now - self._counted > 1.0 or not self._threads:
            threads = sum(self._client.nthreads().values())
            self._check_workers(threads, now)
            self._threads = threads
        return self._threads * CHUNKS_PER_THREAD - len(self._pending)

    def _check_workers(self, threads: int, now: float) -> None:
        if threads or self._counted < 0.0:
            self._counted = now
        elif now - self._counted > NO_WORKERS_TIMEOUT:
            message = f"has had no workers for {NO_WORKERS_TIMEOUT:g} s; {RESUMES}"
            raise ClusterError(self._address, message)


@contextmanager
def _cluster_errors(address: str) -> Iterator[None]:
    """Convert Dask's errors to ClusterError."""
    try:
        yield
    except KilledWorker as fault:
        message = f"{dask_scheduler.killed_message(fault)} {RESUMES.capitalize()}"
        raise ClusterError(address, message) from fault
    except (FutureCancelledError, CommClosedError) as fault:
        raise ClusterError(address, f"the scheduler has gone; {RESUMES}") from fault


def _identity(given: _SharedWork) -> _SharedWork:
    return given


def _run_task(given: _SharedWork, task: ChunkTask) -> ChunkResult | None:
    """Make a chunk on a worker; return None if it was cancelled.

    Raises ClusterError if the worker's packages differ, and FileError if it cannot see the target.
    """
    worker = get_worker()
    # Workers that joined later were not checked at the connection.
    if unlike := dask_scheduler.describe_differences(
        dask_scheduler.installed_versions(KIT), given.kit
    ):
        raise ClusterError(worker.address, unlike)
    work = given.work
    if open_target(work.target).read(checkpoint.JOB) is None:
        raise FileError(
            work.target,
            f"holds no export for worker {worker.address}; expected a folder that all machines "
            "share, or an object store's URL",
        )
    try:
        return chunks.make_chunk(work, task, _cancellation_check(worker, worker.get_current_task()))
    except ChunkAbandoned:
        return None


def _cancellation_check(worker: Any, key: str) -> Callable[[], bool]:
    """Return a function that returns true once a task is cancelled or its client is gone."""
    task = worker.state.tasks[key]
    return lambda: task.state == "cancelled"
