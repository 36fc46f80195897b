"""Work on many scripts in this process or in several, with the results in the order of the jobs."""

import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from typing import TypeVar

from posefield.batch import process_pool
from posefield.common.errors import WorkerDied

Job = TypeVar("Job")
Result = TypeVar("Result")


def results(work: Callable[[Job], Result], jobs: Sequence[Job], workers: int) -> Iterator[Result]:
    """Yield the result of each job in order.

    work: a function that can be pickled. Raises WorkerDied if a process ended before its work.
    """
    if min(workers, len(jobs)) < 2:
        yield from map(work, jobs)
        return
    context = multiprocessing.get_context("spawn")
    with process_pool.worker_environment():
        pool = ProcessPoolExecutor(min(workers, len(jobs)), context)
        futures = [pool.submit(work, job) for job in jobs]
    try:
        for future in futures:
            yield future.result()
    except BrokenProcessPool as fault:
        raise WorkerDied("a worker process has died; the same command resumes") from fault
    finally:
        pool.shutdown(cancel_futures=True)
