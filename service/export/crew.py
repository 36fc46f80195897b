"""Who does the chunks: this process, or several of its children.

A crew is given work and tasks and gives parts as they are done, in any order. It takes no more
tasks ahead than keep everybody busy, so that memory does not grow with their number.
"""

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent import futures
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from itertools import islice
from multiprocessing import connection
from typing import Any

from service.export import chunks
from service.export.chunks import Stop, Stopped, Task
from service.export.job import Work
from service.export.ledger import Part
from service.motion.errors import WorkerDied

Crew = Callable[[Work, Iterator[Task], Stopped], Iterator[Part]]
"""Does tasks until there are no more or it should stop; what was done by then is given still."""

AHEAD = 2
"""Tasks in hand for each process: one that it does, one that waits."""
PATIENCE = 0.1
"""Seconds until a crew that waits looks whether it should stop."""
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def of(workers: int) -> Crew:
    """Crew of so many processes; one is this process."""
    if workers == 1:
        return alone
    return lambda work, tasks, stopped: together(workers, work, tasks, stopped)


def usable_cores() -> int:
    """Cores that this process may run on."""
    return len(os.sched_getaffinity(0))


def alone(work: Work, tasks: Iterator[Task], stopped: Stopped) -> Iterator[Part]:
    """Do the tasks here, one after another."""
    for task in tasks:
        try:
            yield chunks.make(work, task, stopped)
        except Stop:
            return


def together(workers: int, work: Work, tasks: Iterator[Task], stopped: Stopped) -> Iterator[Part]:
    """Do the tasks in processes of their own.

    Raises WorkerDied where one of them goes; the others finish what they are at.
    """
    context = multiprocessing.get_context("spawn")
    stop = context.Event()
    with _one_thread_each():
        pool = ProcessPoolExecutor(workers, context, _begin, (work, stop))
        try:
            yield from _drain(pool, tasks, workers * AHEAD, stopped, stop)
        except BrokenProcessPool as fault:
            if stopped():
                return
            raise WorkerDied(
                "a process of the export has died; what is done stays, and the same command goes on"
            ) from fault
        finally:
            stop.set()
            pool.shutdown(cancel_futures=True)


def _drain(
    pool: ProcessPoolExecutor, tasks: Iterator[Task], ahead: int, stopped: Stopped, stop: Any
) -> Iterator[Part]:
    pending: set[Future[Part | None]] = set()
    while not stopped():
        pending |= {pool.submit(_do, task) for task in islice(tasks, ahead - len(pending))}
        if not pending:
            return
        finished, pending = futures.wait(pending, PATIENCE, futures.FIRST_COMPLETED)
        yield from _results(finished)
    stop.set()
    yield from _results({future for future in pending if not future.cancel()})


def _results(finished: set[Future[Part | None]]) -> Iterator[Part]:
    for future in finished:
        if (part := future.result()) is not None:
            yield part


# What a process of a pool was given when it began.
_given: list[Any] = []


def _begin(work: Work, stop: Any) -> None:
    # A terminal interrupts its whole group: the parent alone decides what comes of it.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_follow_parent, daemon=True).start()
    _given[:] = work, stop


def _follow_parent() -> None:
    """End with the parent, even where that was killed and could say nothing."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    connection.wait([parent.sentinel])
    os._exit(1)


def _do(task: Task) -> Part | None:
    work, stop = _given
    try:
        return chunks.make(work, task, stop.is_set)
    except Stop:
        return None


@contextmanager
def _one_thread_each() -> Iterator[None]:
    """Children begun meanwhile use one thread: there is a process for each core."""
    before = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            os.environ.pop(name) if value is None else os.environ.update({name: value})
