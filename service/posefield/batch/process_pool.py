"""Work in this process, in a pool or on a Dask cluster: chunks of an export, and many scripts.

docs/decisions/0015-process-pool.md compares the pools that were tried and gives the reason for each
precaution around `concurrent.futures`.
"""

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import partial
from itertools import chain, islice
from multiprocessing import connection
from multiprocessing.connection import Connection
from typing import TypeVar

from posefield.batch import checkpoint, chunks
from posefield.batch.checkpoint import ChunkResult
from posefield.batch.chunks import ChunkAbandoned, ChunkTask, StopCheck
from posefield.batch.job import VERSIONED_PACKAGES, WorkerInput
from posefield.batch.target import open_target
from posefield.common.cancellation import SINGLE_THREAD_ENV
from posefield.common.errors import ClusterError, FileError, WorkerDied

POLL_INTERVAL = 0.1
"""Seconds between two checks for a stop."""
RESUMES = "finished chunks are kept, and the same command resumes the export"

Job = TypeVar("Job")
Result = TypeVar("Result")

Runner = Callable[[WorkerInput, Iterator[ChunkTask], StopCheck], Iterator[ChunkResult]]
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


def run_here(
    work: WorkerInput, tasks: Iterator[ChunkTask], stopped: StopCheck
) -> Iterator[ChunkResult]:
    """Run the tasks in this process, one after another."""
    for task in tasks:
        if stopped():
            return
        try:
            yield chunks.make_chunk(work, task, stopped)
        except ChunkAbandoned:
            return


def _run_in_processes(
    workers: int, work: WorkerInput, tasks: Iterator[ChunkTask], stopped: StopCheck
) -> Iterator[ChunkResult]:
    first = list(islice(tasks, workers))
    tasks = chain(first, tasks)
    # Starting a process takes as long as making a thousand clips.
    if len(first) < 2:
        return run_here(work, tasks, stopped)
    return _run_in_pool(len(first), work, tasks, stopped)


def _run_in_pool(
    workers: int, work: WorkerInput, tasks: Iterator[ChunkTask], stopped: StopCheck
) -> Iterator[ChunkResult]:
    """Run the tasks in a pool.

    Raises WorkerDied if a worker process dies, and the MotionError of a failed task.
    """
    context = multiprocessing.get_context("spawn")
    stop_seen, stop = context.Pipe(duplex=False)
    # Small arguments only: a write beyond a pipe's capacity to a dead worker never returns.
    pool = ProcessPoolExecutor(workers, context, _start_worker, (stop_seen,))
    pending: set[Future[ChunkResult | None]] = set()
    try:
        while not stopped():
            ahead = islice(tasks, 2 * workers - len(pending))
            pending |= {_submit(pool, work, task) for task in ahead}
            if not pending:
                return
            done, pending = wait(pending, POLL_INTERVAL, FIRST_COMPLETED)
            yield from _completed_results(done)
        stop.close()
        left = [future for future in pending if not future.cancel()]
        yield from _completed_results(wait(left).done)
    except BrokenProcessPool as fault:
        # The pool waits for ever for a worker that was being started when another died.
        for child in multiprocessing.active_children():
            child.terminate()
        # The signal that ended the worker may be about to reach this process.
        time.sleep(POLL_INTERVAL)
        if not stopped():
            raise WorkerDied(f"a worker process has died; {RESUMES}") from fault
    finally:
        stop.close()
        pool.shutdown(cancel_futures=True)
        stop_seen.close()


def _completed_results(done: "Iterable[Future[ChunkResult | None]]") -> Iterator[ChunkResult]:
    # An abandoned task has no result.
    return (part for future in done if (part := future.result()) is not None)


def _submit(
    pool: ProcessPoolExecutor, work: WorkerInput, task: ChunkTask
) -> "Future[ChunkResult | None]":
    # A submission may start a worker, which inherits this environment.
    with worker_environment():
        try:
            return pool.submit(_run_task, work, task)
        except OSError as fault:
            # Another worker died while this one was started: the pool's pipes are closed already.
            raise BrokenProcessPool(f"a worker could not be started: {fault}") from fault


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


_stopped: StopCheck = lambda: False  # noqa: E731
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


def _run_task(work: WorkerInput, task: ChunkTask) -> ChunkResult | None:
    """Make a chunk in a worker; return None if it was abandoned."""
    # The pool hands over a few tasks in advance, which it cannot cancel.
    if _stopped():
        return None
    try:
        return chunks.make_chunk(work, task, _stopped)
    except ChunkAbandoned:
        return None


def results(work: Callable[[Job], Result], jobs: Sequence[Job], workers: int) -> Iterator[Result]:
    """Yield the result of each job in order.

    work: a function that can be pickled. Raises WorkerDied if a process ended before its work.
    """
    if min(workers, len(jobs)) < 2:
        yield from map(work, jobs)
        return
    context = multiprocessing.get_context("spawn")
    with worker_environment():
        pool = ProcessPoolExecutor(min(workers, len(jobs)), context)
        futures = [pool.submit(work, job) for job in jobs]
    try:
        for future in futures:
            yield future.result()
    except BrokenProcessPool as fault:
        raise WorkerDied("a worker process has died; the same command resumes") from fault
    finally:
        pool.shutdown(cancel_futures=True)


@contextmanager
def cluster_runner(address: str) -> Iterator[Runner]:
    """Connect to the scheduler at an address such as tcp://host:8786, and yield the runner.

    Raises ClusterError if it cannot be used, also while the runner is at work.
    """
    # Imported here because distributed is an optional extra.
    from posefield.common import dask_cluster

    def run(
        work: WorkerInput, tasks: Iterator[ChunkTask], stopped: StopCheck
    ) -> Iterator[ChunkResult]:
        packages = ("posefield", *VERSIONED_PACKAGES)
        for part in dask_cluster.results(client, _make_on_cluster, (work,), zip(tasks), packages):
            yield part
            if stopped():
                return

    try:
        with dask_cluster.connect(address) as client:
            yield run
    except ClusterError as fault:
        raise ClusterError(fault.address, f"{fault.message}; {RESUMES}") from fault


def _make_on_cluster(work: WorkerInput, task: ChunkTask) -> ChunkResult:
    """Make a chunk on a worker; FileError if it does not see the target."""
    if open_target(work.target).read(checkpoint.JOB) is None:
        expected = "expected a folder that all machines share, or an object store's URL"
        raise FileError(work.target, f"holds no export on a worker; {expected}")
    return chunks.make_chunk(work, task)
