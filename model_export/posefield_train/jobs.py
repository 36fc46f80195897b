"""Jobs: one function called with many arguments, in processes of this machine or on a cluster.

Results of finished jobs can be kept in a folder, so that a run that was stopped goes on where it
was. A result is found again by a key over the code of both packages, the versions of the libraries,
the function and all of its arguments. Its file is written as a whole or not at all, and begins with
a checksum. Results are pickles, of which only arrays and data classes of both packages are read: a
file with anything else, which could run code, is refused.
"""

import hashlib
import io
import pickle
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, is_dataclass
from functools import cache
from importlib.metadata import version
from importlib.resources import files
from itertools import chain, islice
from pathlib import Path
from threading import RLock
from typing import TYPE_CHECKING, Any, Protocol

import joblib
from threadpoolctl import threadpool_limits

from posefield.common import atomic_files
from posefield.common.errors import FileError

if TYPE_CHECKING:
    from distributed import Client

_LOCK = RLock()


@contextmanager
def single_threaded() -> Iterator[None]:
    """Run the block on one BLAS thread, in one Python thread of this process at a time.

    Small matrices gain nothing from more threads, and the order of a sum would depend on their
    number; one thread gives the same bytes on every machine. The limit applies to the whole
    process, so the lock prevents one block from lifting it for another.
    """
    with _LOCK, threadpool_limits(1):
        yield


LIBRARIES = ("numpy", "scipy", "onnx", "onnxruntime", "pydantic", "scikit-learn")
"""Libraries whose versions determine a result."""
Arguments = tuple[Any, ...]
"""Arguments of one job, after the shared ones."""


class Jobs(Protocol):
    """Executor of jobs. The results of a job are the same bytes on every executor."""

    def run(
        self, function: Callable[..., Any], arguments: Iterable[Arguments], shared: Arguments = ()
    ) -> Iterator[Any]:
        """Yield the results of ``function(*shared, *job)``, in the order in which jobs finish.

        arguments: of each job, read as jobs are started. shared: first arguments of all jobs, for
        large ones. The first exception of a job ends the iteration.
        """
        ...


@dataclass(frozen=True)
class SerialJobs:
    """Jobs run one after the other in this process."""

    def run(
        self, function: Callable[..., Any], arguments: Iterable[Arguments], shared: Arguments = ()
    ) -> Iterator[Any]:
        """Run jobs as `Jobs.run` does, in their order."""
        for job in arguments:
            yield function(*shared, *job)


def ordered_results(
    jobs: Jobs, function: Callable[..., Any], arguments: Iterable[Arguments], shared: Arguments = ()
) -> list[Any]:
    """Return the results of jobs in the order of their arguments, each made on one BLAS thread."""
    numbered = ((number, job) for number, job in enumerate(arguments))
    results = jobs.run(_run_numbered, numbered, (function, shared))
    return [result for _, result in sorted(results, key=lambda pair: pair[0])]


def _run_numbered(
    function: Callable[..., Any], shared: Arguments, number: int, job: Arguments
) -> tuple[int, Any]:
    with single_threaded():
        return number, function(*shared, *job)


@dataclass(frozen=True)
class ProcessJobs:
    """Processes of this machine, by joblib. count: the most; None for one per core."""

    count: int | None = None

    def run(
        self, function: Callable[..., Any], arguments: Iterable[Arguments], shared: Arguments = ()
    ) -> Iterator[Any]:
        """Run jobs as `Jobs.run` does; a single job runs in this process."""
        jobs = (joblib.delayed(function)(*shared, *job) for job in arguments)
        # joblib starts all its processes at once, so limit them to the number of jobs.
        first = list(islice(jobs, self.count or joblib.cpu_count()))
        parallel = joblib.Parallel(n_jobs=max(len(first), 1), return_as="generator_unordered")
        yield from parallel(chain(first, jobs))


@dataclass(frozen=True)
class DaskJobs:
    """Workers of a Dask cluster, which must have the same versions of the libraries."""

    client: "Client"

    def run(
        self, function: Callable[..., Any], arguments: Iterable[Arguments], shared: Arguments = ()
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


SUFFIX = ".result"
PACKAGES = ("posefield", "posefield_train")
ARRAY_MAKERS = ("_reconstruct", "_frombuffer", "scalar", "ndarray", "dtype")
CHECKSUM_BYTES = hashlib.sha256().digest_size


@dataclass(frozen=True)
class FinishedJobs:
    """Jobs whose results are kept.

    jobs: executor of those without one. folder: of the results. packages: whose data classes they
    may hold.
    """

    jobs: Jobs
    folder: Path
    packages: tuple[str, ...] = PACKAGES

    def run(
        self, function: Callable[..., Any], arguments: Iterable[Arguments], shared: Arguments = ()
    ) -> Iterator[Any]:
        """Yield the results of jobs as `Jobs.run` does, kept ones first.

        Raises FileError if a result cannot be written, and as `read_result`.
        """
        common = joblib.hash((code_key(), f"{function.__module__}.{function.__name__}", shared))
        listed = list(arguments)
        paths = [self.folder / f"{joblib.hash((common, job))}{SUFFIX}" for job in listed]
        left = []
        for number, file in enumerate(paths):
            finished = read_result(file, self.packages)
            if finished:
                yield finished[0]
            else:
                left.append((number, listed[number]))
        for number, result in self.jobs.run(_run_numbered, left, (function, shared)):
            content = pickle.dumps(result, protocol=pickle.HIGHEST_PROTOCOL)
            atomic_files.write(hashlib.sha256(content).digest() + content, paths[number])
            yield result


def read_result(file: Path, packages: tuple[str, ...]) -> tuple[Any] | None:
    """Return a kept result; None if there is none, or its checksum is wrong.

    packages: whose data classes it may hold. Raises FileError for a file that holds more than data.
    """
    if not file.exists():
        return None
    content = file.read_bytes()
    checksum, content = content[:CHECKSUM_BYTES], content[CHECKSUM_BYTES:]
    if hashlib.sha256(content).digest() != checksum:
        return None
    try:
        return (_DataUnpickler(io.BytesIO(content), packages).load(),)
    except pickle.UnpicklingError as fault:
        raise FileError(file, f"{fault}, expected arrays and data classes of posefield") from None


class _DataUnpickler(pickle.Unpickler):
    """Reader of pickles that names no function but those by which NumPy makes arrays."""

    def __init__(self, file: io.BytesIO, packages: tuple[str, ...]) -> None:
        super().__init__(file)
        self.packages = packages

    def find_class(self, module: str, name: str) -> Any:
        """Return a class or a function of NumPy; UnpicklingError for any that is not data."""
        package = module.partition(".")[0]
        if package == "numpy" and name in ARRAY_MAKERS:
            return super().find_class(module, name)
        if package in self.packages:
            kind = super().find_class(module, name)
            if isinstance(kind, type) and is_dataclass(kind):
                return kind
        raise pickle.UnpicklingError(f"names {module}.{name}")


@cache
def code_key() -> str:
    """Return a key over the sources of both packages and the versions of the libraries."""
    digest = hashlib.sha256()
    for package in PACKAGES:
        folder = Path(str(files(package)))
        for file in sorted(folder.rglob("*.py")):
            digest.update(file.relative_to(folder).as_posix().encode())
            digest.update(hashlib.sha256(file.read_bytes()).digest())
    for name in LIBRARIES:
        digest.update(f"{name} {version(name)}".encode())
    return digest.hexdigest()
