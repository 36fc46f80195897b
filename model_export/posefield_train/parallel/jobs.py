"""Jobs: one function called with many arguments, in processes of this machine or on a cluster."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import chain, islice
from typing import Any, Protocol

import joblib

Arguments = tuple[Any, ...]
"""Arguments of one job, after the shared ones."""


class Jobs(Protocol):
    """Executor of jobs. The results of a job are the same bytes on every executor."""

    def run(
        self,
        function: Callable[..., Any],
        arguments: Iterable[Arguments],
        shared: Arguments = (),
    ) -> Iterator[Any]:
        """Yield the results of ``function(*shared, *own)``, in the order in which jobs finish.

        arguments: of each job, read as jobs are started. shared: first arguments of all jobs, for
        large ones. The first exception of a job ends the iteration.
        """
        ...


@dataclass(frozen=True)
class ProcessJobs:
    """Processes of this machine, by joblib. count: the most; None for one per core."""

    count: int | None = None

    def run(
        self,
        function: Callable[..., Any],
        arguments: Iterable[Arguments],
        shared: Arguments = (),
    ) -> Iterator[Any]:
        """Run jobs as `Jobs.run` does; a single job runs in this process."""
        jobs = (joblib.delayed(function)(*shared, *own) for own in arguments)
        # joblib starts all its processes at once, so limit them to the number of jobs.
        first = list(islice(jobs, self.count or joblib.cpu_count()))
        parallel = joblib.Parallel(n_jobs=max(len(first), 1), return_as="generator_unordered")
        yield from parallel(chain(first, jobs))
