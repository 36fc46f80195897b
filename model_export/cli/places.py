"""Where the work of a command is done: in processes here, or on a cluster."""

from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from typing import Annotated, Any

import typer

from service.motion.errors import InvalidField

Scheduler = Annotated[
    str | None,
    typer.Option(
        help="run on the workers of a Dask scheduler, which must have posefield installed too",
        metavar="tcp://HOST:PORT",
    ),
]


@dataclass(frozen=True)
class Place:
    """Where several are trained: in so many processes here, or on a cluster."""

    jobs: int | None
    scheduler: str | None

    def __post_init__(self) -> None:
        if self.jobs is not None and self.jobs < 1:
            raise InvalidField("jobs", f"{self.jobs}, expected 1 or more")


def jobs(scheduler: str | None, shared: Sequence[Any] = ()) -> AbstractContextManager[None]:
    """Inside, jobs run on a cluster, or here where none is named."""
    if scheduler is None:
        return nullcontext()
    from model_export import cluster

    return cluster.jobs(scheduler, shared)
