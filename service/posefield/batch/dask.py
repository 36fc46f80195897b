"""Export on the workers of a Dask cluster: chunks are pure, and may be made twice."""

from collections.abc import Iterator
from contextlib import contextmanager

from posefield.batch import checkpoint, chunks
from posefield.batch.checkpoint import ChunkResult
from posefield.batch.chunks import ChunkTask, StopCheck
from posefield.batch.job import VERSIONED_PACKAGES, WorkerInput
from posefield.batch.process_pool import RESUMES, Runner
from posefield.batch.target import open_target
from posefield.common import dask_cluster
from posefield.common.errors import ClusterError, FileError


@contextmanager
def runner(address: str) -> Iterator[Runner]:
    """Connect to the scheduler at an address such as tcp://host:8786, and yield the runner.

    Raises ClusterError if it cannot be used, also while the runner is at work.
    """

    def run(
        work: WorkerInput, tasks: Iterator[ChunkTask], stopped: StopCheck
    ) -> Iterator[ChunkResult]:
        packages = ("posefield", *VERSIONED_PACKAGES)
        for part in dask_cluster.results(client, _make_chunk, (work,), zip(tasks), packages):
            yield part
            if stopped():
                return

    try:
        with dask_cluster.connect(address) as client:
            yield run
    except ClusterError as fault:
        raise ClusterError(fault.address, f"{fault.message}; {RESUMES}") from fault


def _make_chunk(work: WorkerInput, task: ChunkTask) -> ChunkResult:
    """Make a chunk on a worker; FileError if it does not see the target."""
    if open_target(work.target).read(checkpoint.JOB) is None:
        expected = "expected a folder that all machines share, or an object store's URL"
        raise FileError(work.target, f"holds no export on a worker; {expected}")
    return chunks.make_chunk(work, task)
