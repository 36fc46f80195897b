"""Jobs: one function called with many arguments, in processes of this machine or on a cluster."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import chain, islice
from typing import TYPE_CHECKING, Any, Protocol

import joblib

from posefield_train.parallel import single_thread

if TYPE_CHECKING:
    from distributed import Client

LIBRARIES = ("numpy", "scipy", "onnx", "onnxruntime", "pydantic", "scikit-learn")
"""Libraries whose versions determine a result."""
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
class SerialJobs:
    """Jobs run one after the other in this process."""

    def run(
        self,
        function: Callable[..., Any],
        arguments: Iterable[Arguments],
        shared: Arguments = (),
    ) -> Iterator[Any]:
        """Run jobs as `Jobs.run` does, in their order."""
        for own in arguments:
            yield function(*shared, *own)


def ordered_results(
    jobs: Jobs,
    function: Callable[..., Any],
    arguments: Iterable[Arguments],
    shared: Arguments = (),
) -> list[Any]:
    """Return the results of jobs in the order of their arguments, each made on one BLAS thread."""
    numbered = ((number, own) for number, own in enumerate(arguments))
    found = jobs.run(_run_numbered, numbered, (function, shared))
    return [result for _, result in sorted(found, key=lambda pair: pair[0])]


def _run_numbered(
    function: Callable[..., Any], shared: Arguments, number: int, own: Arguments
) -> tuple[int, Any]:
    with single_thread.single_threaded():
        return number, function(*shared, *own)


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


@dataclass(frozen=True)
class DaskJobs:
    """Workers of a Dask cluster, which must have the same versions of the libraries."""

    client: "Client"

    def run(
        self,
        function: Callable[..., Any],
        arguments: Iterable[Arguments],
        shared: Arguments = (),
    ) -> Iterator[Any]:
        """Run jobs as `Jobs.run` does; ClusterError if the cluster cannot do them."""
        from posefield.common import dask_cluster

        packages = ("posefield", *LIBRARIES)
        return dask_cluster.results(self.client, function, shared, arguments, packages)


@contextmanager
def connect(address: str) -> Iterator[DaskJobs]:
    """Connect to the scheduler at an address such as tcp://host:8786; ClusterError without one."""
    # Imported here because distributed is an optional extra.
    from posefield.common import dask_cluster

    with dask_cluster.connect(address) as client:
        yield DaskJobs(client)
