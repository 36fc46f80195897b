"""Export in this process or in a pool of processes.

docs/decisions/0015-process-pool.md compares the pools that were tried and gives the reason for each
precaution around `concurrent.futures`.
"""

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import partial
from itertools import chain, islice
from multiprocessing import connection
from multiprocessing.connection import Connection

from posefield.batch import chunks
from posefield.batch.checkpoint import Part
from posefield.batch.chunks import Stop, Stopped, Task
from posefield.batch.job import Work
from posefield.common.cpu_cores import ALONE
from posefield.common.errors import WorkerDied

POLL = 0.1
"""Seconds between two checks for a stop."""
RESUMES = "finished chunks are kept, and the same command resumes the export"

Runner = Callable[[Work, Iterator[Task], Stopped], Iterator[Part]]
"""Run tasks until none is left or `stopped()` is true; yield the part of each finished one.

Parts are in the order of completion. Only a few tasks are taken in advance, so that memory does not
grow with their number.
"""


def runner(workers: int) -> Runner:
    """Return the runner with this number of processes; 1 is the calling process."""
    return run_here if workers == 1 else partial(_run_in_processes, workers)


def usable_cores() -> int:
    """Return the number of cores that this process may run on."""
    return len(os.sched_getaffinity(0))


def run_here(work: Work, tasks: Iterator[Task], stopped: Stopped) -> Iterator[Part]:
    """Run the tasks in this process, one after another."""
    for task in tasks:
        if stopped():
            return
        try:
            yield chunks.make(work, task, stopped)
        except Stop:
            return


def _run_in_processes(
    workers: int, work: Work, tasks: Iterator[Task], stopped: Stopped
) -> Iterator[Part]:
    first = list(islice(tasks, workers))
    tasks = chain(first, tasks)
    # Starting a process takes as long as making a thousand clips.
    if len(first) < 2:
        return run_here(work, tasks, stopped)
    return _pooled(len(first), work, tasks, stopped)


def _pooled(workers: int, work: Work, tasks: Iterator[Task], stopped: Stopped) -> Iterator[Part]:
    """Run the tasks in a pool.

    Raises WorkerDied if a worker process dies, and the MotionError of a failed task.
    """
    context = multiprocessing.get_context("spawn")
    stop_seen, stop = context.Pipe(duplex=False)
    # Small arguments only: a write beyond a pipe's capacity to a dead worker never returns.
    pool = ProcessPoolExecutor(workers, context, _start_worker, (stop_seen,))
    try:
        submit = partial(_submit, pool, work)
        yield from _parts(submit, 2 * workers, tasks, stopped, stop.close)
    except BrokenProcessPool as fault:
        # The pool waits for ever for a worker that was being started when another died.
        for child in multiprocessing.active_children():
            child.terminate()
        # The signal that ended the worker may be about to reach this process.
        time.sleep(POLL)
        if not stopped():
            raise WorkerDied(f"a worker process has died; {RESUMES}") from fault
    finally:
        stop.close()
        pool.shutdown(cancel_futures=True)
        stop_seen.close()


def _parts(
    submit: Callable[[Task], "Future[Part | None]"],
    ahead: int,
    tasks: Iterator[Task],
    stopped: Stopped,
    stop: Callable[[], None],
) -> Iterator[Part]:
    """Yield the part of each finished task, with `ahead` of them submitted at any time."""
    pending: set[Future[Part | None]] = set()
    while not stopped():
        pending |= {submit(task) for task in islice(tasks, ahead - len(pending))}
        if not pending:
            return
        done, pending = wait(pending, POLL, FIRST_COMPLETED)
        yield from _made(done)
    stop()
    yield from _made(wait([future for future in pending if not future.cancel()]).done)


def _made(done: "Iterable[Future[Part | None]]") -> Iterator[Part]:
    """Yield the results of futures, except those of abandoned tasks."""
    return (part for future in done if (part := future.result()) is not None)


def _submit(pool: ProcessPoolExecutor, work: Work, task: Task) -> "Future[Part | None]":
    # A submission may start a worker, which inherits this environment.
    with _worker_environment():
        return pool.submit(_make, work, task)


@contextmanager
def _worker_environment() -> Iterator[None]:
    """Set the environment and signal mask that worker processes inherit when they are started.

    Each uses one thread, as there is a worker per core, and blocks SIGINT: a terminal sends Ctrl-C
    to all processes, and only the parent handles it.
    """
    before = {name: os.environ.get(name) for name in ALONE}
    os.environ.update(ALONE)
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        for name, value in before.items():
            os.environ.pop(name) if value is None else os.environ.update({name: value})


_stopped: Stopped = lambda: False  # noqa: E731
"""Returns true in a worker when the export should stop."""


def _start_worker(stop_seen: Connection) -> None:
    global _stopped
    # Readable once the parent has closed its end.
    _stopped = stop_seen.poll
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """End this process when its parent has ended; the pool's own workers would wait for ever."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    connection.wait([parent.sentinel])
    os._exit(1)


def _make(work: Work, task: Task) -> Part | None:
    """Make a chunk in a worker; return None if it was abandoned."""
    # The pool hands over a few tasks in advance, which it cannot cancel.
    if _stopped():
        return None
    try:
        return chunks.make(work, task, _stopped)
    except Stop:
        return None
