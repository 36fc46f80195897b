"""Executors of a command's jobs: processes of this machine, or a cluster."""

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from posefield.common.errors import InvalidField

if TYPE_CHECKING:
    from posefield_train.jobs import Jobs

Scheduler = Annotated[
    str | None,
    typer.Option(
        help="run on the workers of this Dask scheduler; posefield must be installed on them",
        metavar="tcp://HOST:PORT",
    ),
]


@dataclass(frozen=True)
class ExecutorOptions:
    """Executor of the training of a model, or of several.

    jobs: number of processes; None for one per core of several recipes, and for this process alone
    of one. scheduler: address of a cluster's scheduler; None for this machine. resume: folder of
    finished parts of one training; None to keep none.
    """

    jobs: Annotated[
        int | None,
        typer.Option(
            help="number of processes; default: one per core for several recipes, this one alone "
            "for one recipe"
        ),
    ] = None
    scheduler: Scheduler = None
    resume: Annotated[
        Path | None,
        typer.Option(
            help="folder of finished parts of a training that was stopped: those of equal data, "
            "code and settings are read instead of computed, and new ones are kept",
            metavar="FOLDER",
        ),
    ] = None

    def __post_init__(self) -> None:
        if self.jobs is not None and self.jobs < 1:
            raise InvalidField("jobs", f"{self.jobs}, expected 1 or more")


@contextmanager
def parts(options: ExecutorOptions) -> "Iterator[Jobs]":
    """Open an executor of the parts of one training: this process unless others are asked for."""
    from posefield_train.jobs import FinishedJobs, SerialJobs

    alone = options.jobs is None and options.scheduler is None
    with (
        nullcontext(SerialJobs())
        if alone
        else jobs(options.scheduler, options.jobs) as jobs_of_options
    ):
        yield FinishedJobs(jobs_of_options, options.resume) if options.resume else jobs_of_options


def jobs(scheduler: str | None, count: int | None = None) -> "AbstractContextManager[Jobs]":
    """Open an executor of jobs: a cluster, or processes of this machine if scheduler is None.

    count: number of processes; None for one per core.
    """
    if scheduler is None:
        from posefield_train.jobs import ProcessJobs

        return nullcontext(ProcessJobs(count))
    from posefield_train.jobs import connect

    return connect(scheduler)
