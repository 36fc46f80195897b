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
from posefield.batch.checkpoint import Part
from posefield.batch.chunks import Stop, Stopped, Task
from posefield.batch.job import MAKERS, Work
from posefield.batch.process_pool import RESUMES, Runner
from posefield.batch.target import open_target
from posefield.common import dask_scheduler
from posefield.common.errors import ClusterError, FileError

KIT = dask_scheduler.Kit(("posefield",), MAKERS)
"""Code and packages on which a chunk's bytes depend."""
AHEAD = 3
"""Chunks submitted for each thread of the workers, so that none waits for the next."""
PATIENCE = 0.1
"""Seconds between two checks for a stop and for the number of workers."""
FETCH = 5.0
"""Seconds until the result of a finished chunk is considered lost with its worker."""
DESERTED = 60.0
"""Seconds without workers after which the export fails."""


@contextmanager
def runner(address: str) -> Iterator[Runner]:
    """Connect to the scheduler at an address such as tcp://host:8786, and yield the runner.

    Raises ClusterError if it cannot be used; the runner raises it if the scheduler ends, if there
    are no workers for a minute, or if one chunk has ended every worker that ran it.
    """
    with dask_scheduler.connect(address, KIT) as client:
        yield partial(_together, client, address)


def _together(
    client: Client, address: str, work: Work, tasks: Iterator[Task], stopped: Stopped
) -> Iterator[Part]:
    with _said(address):
        hands = _Hands(client, address, _Given.by(client, work))
        try:
            yield from hands.parts(tasks, stopped)
        finally:
            hands.put_down()


@dataclass(frozen=True)
class _Given:
    """Data that every chunk needs. kit: packages and versions that a worker must have installed."""

    work: Work
    kit: Mapping[str, str]

    @classmethod
    def by(cls, client: Client, work: Work) -> Future:
        """Return a future of this data, which the workers keep as long as the future exists."""
        own = cls(work, dask_scheduler.installed(KIT))
        return client.submit(_same, own, key=f"posefield-{uuid.uuid4().hex}")


class _Hands:
    """Chunks that are submitted and not yet collected."""

    def __init__(self, client: Client, address: str, given: Future) -> None:
        self._client, self._address, self._given = client, address, given
        self._run = uuid.uuid4().hex
        self._pending: set[Future] = set()
        self._ready: SimpleQueue[Future] = SimpleQueue()
        self._threads, self._counted = 0, -1.0

    def parts(self, tasks: Iterator[Task], stopped: Stopped) -> Iterator[Part]:
        """Yield the parts of tasks in the order of completion."""
        while not stopped():
            for task in islice(tasks, max(self._room(), 0)):
                self._give(task)
            if not self._pending:
                return
            yield from self._take()
        while not self._ready.empty():
            yield from self._take()

    def put_down(self) -> None:
        """Cancel the submitted chunks; workers stop within a batch and record no part."""
        self._client.cancel([*self._pending, self._given])

    def _give(self, task: Task) -> None:
        key = f"chunk-{task.number}-{self._run}"
        future = self._client.submit(_do, self._given, task, key=key)
        self._pending.add(future)
        future.add_done_callback(self._ready.put)

    def _take(self) -> Iterator[Part]:
        try:
            future = self._ready.get(timeout=PATIENCE)
            part = future.result(timeout=FETCH)
        except Empty:
            return
        except TimeoutError:
            # The worker died before the result was fetched: Dask repeats the chunk.
            future.add_done_callback(self._ready.put)
            return
        self._pending.discard(future)
        yield part

    def _room(self) -> int:
        """Return how many more chunks to submit, by the present number of workers' threads."""
        now = time.monotonic()
        if now - self._counted > 1.0 or not self._threads:
            threads = sum(self._client.nthreads().values())
            self._expect_somebody(threads, now)
            self._threads = threads
        return self._threads * AHEAD - len(self._pending)

    def _expect_somebody(self, threads: int, now: float) -> None:
        if threads or self._counted < 0.0:
            self._counted = now
        elif now - self._counted > DESERTED:
            message = f"has had no workers for {DESERTED:g} s; {RESUMES}"
            raise ClusterError(self._address, message)


@contextmanager
def _said(address: str) -> Iterator[None]:
    """Convert Dask's errors to ClusterError."""
    try:
        yield
    except KilledWorker as fault:
        message = f"{dask_scheduler.killed(fault)} {RESUMES.capitalize()}"
        raise ClusterError(address, message) from fault
    except (FutureCancelledError, CommClosedError) as fault:
        raise ClusterError(address, f"the scheduler has gone; {RESUMES}") from fault


def _same(given: _Given) -> _Given:
    return given


def _do(given: _Given, task: Task) -> Part | None:
    """Make a chunk on a worker; return None if it was cancelled.

    Raises ClusterError if the worker's packages differ, and FileError if it cannot see the target.
    """
    worker = get_worker()
    # Workers that joined later were not checked at the connection.
    if unlike := dask_scheduler.differences(dask_scheduler.installed(KIT), given.kit):
        raise ClusterError(worker.address, unlike)
    work = given.work
    if open_target(work.target).read(checkpoint.JOB) is None:
        raise FileError(
            work.target,
            f"holds no export for worker {worker.address}; expected a folder that all machines "
            "share, or an object store's URL",
        )
    try:
        return chunks.make(work, task, _abandoned(worker, worker.get_current_task()))
    except Stop:
        return None


def _abandoned(worker: Any, key: str) -> Callable[[], bool]:
    """Return a function that returns true once a task is cancelled or its client is gone."""
    task = worker.state.tasks[key]
    return lambda: task.state == "cancelled"
