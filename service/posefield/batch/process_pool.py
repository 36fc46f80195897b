"""Work in this process, in a pool or on a Dask cluster: chunks of an export, and many scripts.

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
from contextlib import AbstractContextManager, contextmanager, nullcontext
from contextvars import copy_context
from functools import partial
from itertools import chain, islice
from multiprocessing import connection
from multiprocessing.connection import Connection
from typing import Any

from threadpoolctl import threadpool_limits

from posefield.batch.job import VERSIONED_PACKAGES
from posefield.common import cancellation
from posefield.common.cancellation import SINGLE_THREAD_ENV, Cancellation, Cancelled
from posefield.common.errors import ClusterError, InvalidField, WorkerDied

POLL_INTERVAL = 0.1
"""Seconds between two checks for a stop."""
RESUMES = "finished chunks are kept, and the same command resumes the export"

StopCheck = Callable[[], bool]
"""Returns true when the work should stop."""
Task = Any
Result = Any
Function = Callable[[Task], Result]
"""Function of one task, which can be pickled; it may raise Cancelled to abandon the task."""
Runner = Callable[[Function, Iterator[Task], StopCheck], Iterator[Result]]
"""Call a function with tasks until none is left or `stopped()` is true; yield each result.

Results are in the order of completion. Only a few tasks are taken in advance, so that memory does
not grow with their number.
"""


class StopSignal(Cancellation):
    """Cancellation of tasks that should stop, of which `check` asks at intervals."""

    def __init__(self, stopped: StopCheck) -> None:
        super().__init__()
        self._stopped = stopped
        self._checked = 0.0

    @property
    def requested(self) -> bool:
        """Return whether the work should stop."""
        return self._stopped()

    def check(self) -> None:
        """Raise Cancelled if the work should stop."""
        now = time.monotonic()
        if now - self._checked > POLL_INTERVAL:
            self._checked = now
            if self._stopped():
                raise Cancelled


def runner(workers: int, resumes: str = RESUMES) -> Runner:
    """Return the runner with this number of processes; 1 is the calling process.

    resumes: end of the message if a process dies.
    """
    return run_here if workers == 1 else partial(_run_in_processes, workers, resumes)


def open_runner(
    workers: int | None, scheduler: str | None = None, resumes: str = RESUMES
) -> AbstractContextManager[Runner]:
    """Return the processes of a command, one per core by default, or the cluster of a scheduler.

    Raises InvalidField for numbers that do not fit.
    """
    if workers is not None and scheduler is not None:
        raise InvalidField("workers", f"{workers}, but a scheduler has its own; expected one")
    if workers is not None and workers < 1:
        raise InvalidField("workers", f"{workers}, expected 1 or more")
    if scheduler is None:
        return nullcontext(runner(workers or usable_cores(), resumes))
    return cluster_runner(scheduler)


def usable_cores() -> int:
    """Return the number of cores that this process may run on."""
    return len(os.sched_getaffinity(0))


def limit_threads() -> None:
    """Limit BLAS to one thread, unless the environment sets its number of threads.

    Idle BLAS threads spin: with two, a grid of sigma takes 1.5 to 8 times the CPU time, a crowd of
    takes twice. Last bits depend on their number, and worker processes and exports have one.
    """
    if not SINGLE_THREAD_ENV.keys() & os.environ.keys():
        threadpool_limits(1, user_api="blas")


def run_here(
    function: Function, tasks: Iterator[Task], stopped: StopCheck = lambda: False
) -> Iterator[Result]:
    """Run the tasks in this process, one after another."""
    context = copy_context()
    context.run(cancellation.current.set, StopSignal(stopped))
    for task in tasks:
        if stopped():
            return
        try:
            result = context.run(function, task)
        except Cancelled:
            return
        yield result


def _run_in_processes(
    workers: int, resumes: str, function: Function, tasks: Iterator[Task], stopped: StopCheck
) -> Iterator[Result]:
    first = list(islice(tasks, workers))
    tasks = chain(first, tasks)
    # Starting a process takes as long as making a thousand clips.
    if len(first) < 2:
        return run_here(function, tasks, stopped)
    return _run_in_pool(len(first), resumes, function, tasks, stopped)


def _run_in_pool(
    workers: int, resumes: str, function: Function, tasks: Iterator[Task], stopped: StopCheck
) -> Iterator[Result]:
    """Run the tasks in a pool.

    Raises WorkerDied if a worker process dies, and the MotionError of a failed task.
    """
    context = multiprocessing.get_context("spawn")
    stop_seen, stop = context.Pipe(duplex=False)
    # Small arguments only: a write beyond a pipe's capacity to a dead worker never returns.
    pool = ProcessPoolExecutor(workers, context, _start_worker, (stop_seen,))
    pending: set[Future[Result]] = set()
    try:
        while not stopped():
            upcoming = islice(tasks, 2 * workers - len(pending))
            pending |= {_submit(pool, function, task) for task in upcoming}
            if not pending:
                return
            done, pending = wait(pending, POLL_INTERVAL, FIRST_COMPLETED)
            yield from _completed_results(done)
        stop.close()
        running = [future for future in pending if not future.cancel()]
        yield from _completed_results(wait(running).done)
    except BrokenProcessPool as error:
        # The pool waits for ever for a worker that was being started when another died.
        for child in multiprocessing.active_children():
            child.terminate()
        # The signal that ended the worker may be about to reach this process.
        time.sleep(POLL_INTERVAL)
        if not stopped():
            raise WorkerDied(f"a worker process has died; {resumes}") from error
    finally:
        stop.close()
        pool.shutdown(cancel_futures=True)
        stop_seen.close()


def _completed_results(done: "Iterable[Future[Result]]") -> Iterator[Result]:
    # An abandoned task has no result.
    return (result for future in done if (result := future.result()) is not None)


def _submit(pool: ProcessPoolExecutor, function: Function, task: Task) -> "Future[Result]":
    # A submission may start a worker, which inherits this environment.
    with worker_environment():
        try:
            return pool.submit(_run_task, function, task)
        except OSError as error:
            # Another worker died while this one was started: the pool's pipes are closed already.
            raise BrokenProcessPool(f"a worker could not be started: {error}") from error


@contextmanager
def worker_environment() -> Iterator[None]:
    """Set the environment and signal mask that worker processes inherit when they are started.

    Each uses one thread, as there is a worker per core, and blocks SIGINT: a terminal sends Ctrl-C
    to all processes, and only the parent handles it.
    """
    before = {name: os.environ.get(name) for name in SINGLE_THREAD_ENV}
    os.environ.update(SINGLE_THREAD_ENV)
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        for name, value in before.items():
            os.environ.pop(name) if value is None else os.environ.update({name: value})


def _start_worker(stop_seen: Connection) -> None:
    # Readable once the parent has closed its end.
    cancellation.current.set(StopSignal(stop_seen.poll))
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """End this process when its parent has ended; the pool's own workers would wait for ever."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    connection.wait([parent.sentinel])
    os._exit(1)


def _run_task(function: Function, task: Task) -> Result:
    """Run a task in a worker; return None if it was abandoned."""
    signal = cancellation.current.get()
    # The pool hands over a few tasks in advance, which it cannot cancel.
    if signal is not None and signal.requested:
        return None
    try:
        return function(task)
    except Cancelled:
        return None


@contextmanager
def cluster_runner(address: str) -> Iterator[Runner]:
    """Connect to the scheduler at an address such as tcp://host:8786, and yield the runner.

    Raises ClusterError if it cannot be used, also while the runner is at work.
    """
    # Imported here because distributed is an optional extra.
    from posefield.common import dask_cluster

    def run(function: Function, tasks: Iterator[Task], stopped: StopCheck) -> Iterator[Result]:
        packages = ("posefield", *VERSIONED_PACKAGES)
        for result in dask_cluster.results(client, function, (), zip(tasks), packages):
            yield result
            if stopped():
                return

    try:
        with dask_cluster.connect(address) as client:
            yield run
    except ClusterError as error:
        raise ClusterError(error.address, f"{error.message}; {RESUMES}") from error
