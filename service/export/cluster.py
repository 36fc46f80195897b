"""A crew on a Dask cluster: chunks are done by the workers of a scheduler.

A worker that dies loses nothing: Dask gives what it had to another, and a chunk done twice leaves
the same files. The model's bytes and the job go to the workers as the result of a task of their
own: what was scattered is lost with those who hold it, but a task is done again.
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
from distributed.worker import thread_state

from service import scheduler
from service.export import chunks, ledger
from service.export.chunks import Stop, Stopped, Task
from service.export.crew import Crew
from service.export.job import MAKERS, Work
from service.export.ledger import Part
from service.export.target import open_target
from service.motion.errors import ClusterError, FileError

KIT = scheduler.Kit(("service",), MAKERS)
"""What a chunk's bytes hang on."""
AHEAD = 3
"""Chunks in hand for each thread of the workers: the next ones are there when one is done."""
PATIENCE = 0.1
"""Seconds until a crew that waits looks whether it should stop, and who works."""
FETCH = 5.0
"""Seconds until a part that was done is taken for lost with its worker."""
DESERTED = 60.0
"""Seconds without any worker after which nobody is expected to come back."""
GOES_ON = "what is done stays, and the same command goes on"


@contextmanager
def crew(address: str) -> Iterator[Crew]:
    """Crew of the workers of the scheduler at an address such as tcp://host:8786.

    Raises ClusterError where it cannot be worked on; the crew itself, where the scheduler goes, all
    workers stay away, or a chunk has killed every worker that took it up.
    """
    with scheduler.connect(address, KIT) as client:
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
    """What every chunk needs, wherever it is done; kit: what must be installed there."""

    work: Work
    kit: Mapping[str, str]

    @classmethod
    def by(cls, client: Client, work: Work) -> Future:
        """The same, held by the workers for as long as this is."""
        own = cls(work, scheduler.installed(KIT))
        return client.submit(_same, own, key=f"posefield-{uuid.uuid4().hex}")


class _Hands:
    """Chunks that are in hand: given out, and not yet taken back."""

    def __init__(self, client: Client, address: str, given: Future) -> None:
        self._client, self._address, self._given = client, address, given
        self._run = uuid.uuid4().hex
        self._pending: set[Future] = set()
        self._ready: SimpleQueue[Future] = SimpleQueue()
        self._threads, self._counted = 0, -1.0

    def parts(self, tasks: Iterator[Task], stopped: Stopped) -> Iterator[Part]:
        """Parts of tasks as they are done."""
        while not stopped():
            for task in islice(tasks, max(self._room(), 0)):
                self._give(task)
            if not self._pending:
                return
            yield from self._take()
        while not self._ready.empty():
            yield from self._take()

    def put_down(self) -> None:
        """Cancel what is in hand: workers stop within a batch, and leave no part."""
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
            # Its worker died before the result was fetched: it is done again.
            future.add_done_callback(self._ready.put)
            return
        self._pending.discard(future)
        yield part

    def _room(self) -> int:
        """How many more chunks to give out; workers come and go."""
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
            message = f"has had no workers for {DESERTED:g} s; {GOES_ON}"
            raise ClusterError(self._address, message)


@contextmanager
def _said(address: str) -> Iterator[None]:
    """What Dask says in words of ours."""
    try:
        yield
    except KilledWorker as fault:
        message = f"{scheduler.killed(fault)} {GOES_ON.capitalize()}"
        raise ClusterError(address, message) from fault
    except (FutureCancelledError, CommClosedError) as fault:
        raise ClusterError(address, f"the scheduler has gone; {GOES_ON}") from fault


def _same(given: _Given) -> _Given:
    return given


def _do(given: _Given, task: Task) -> Part | None:
    """A chunk, on a worker; nothing where nobody waits for it any more."""
    worker = get_worker()
    # Workers that came later were not asked.
    if unlike := scheduler.differences(scheduler.installed(KIT), given.kit):
        raise ClusterError(worker.address, unlike)
    work = given.work
    if open_target(work.target).read(ledger.JOB) is None:
        raise FileError(
            work.target,
            f"holds no export for worker {worker.address}; expected a folder that all machines "
            "share, or an object store's URL",
        )
    try:
        return chunks.make(work, task, _abandoned(worker, thread_state.key))
    except Stop:
        return None


def _abandoned(worker: Any, key: str) -> Callable[[], bool]:
    """Whether nobody waits for a task any more: it was cancelled, or who gave it has gone."""
    task = worker.state.tasks[key]
    return lambda: task.state == "cancelled"
