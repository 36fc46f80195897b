"""Rows that are sound but cannot be written in the layout, or the unit, asked for."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from service.encode import ENCODERS
from service.export import layouts
from service.export.job import Job
from service.export.query import KEPT, Fault, Query, Source, Survey
from service.motion.errors import InvalidField


def to(job: Job, source: Source) -> Source:
    """The source, with faults instead of queries that the job cannot write."""
    misfit = layouts.find(job.layout).misfit
    if misfit is None and (job.unit or job.up):
        misfit = _unlawful
    return source if misfit is None else Fitting(source, job, misfit)


def _unlawful(job: Job, query: Query) -> str | None:
    """Why a query's format cannot be in the job's unit and up axis; none if it can."""
    try:
        ENCODERS[query.format].convention(job.unit, job.up)
    except InvalidField as fault:
        return str(fault)
    return None


@dataclass(frozen=True)
class Fitting:
    """Rows of a source, of which some cannot be written for a reason that `misfit` gives."""

    source: Source
    job: Job
    misfit: Callable[[Job, Query], str | None]

    @property
    def digest(self) -> str:
        """Of the source: why rows do not fit is the job's."""
        return self.source.digest

    @property
    def count(self) -> int | None:
        """Rows of the source, if they are known."""
        return self.source.count

    def rows(self) -> Iterator[Query | Fault]:
        """Every row."""
        for row in self.source.rows():
            why = self.misfit(self.job, row) if isinstance(row, Query) else None
            yield row if why is None else Fault(row.place, why)

    def survey(self) -> Survey:
        """Every row looked at, and none kept but the first faults."""
        total, faulty, faults = 0, 0, []
        for row in self.rows():
            total += 1
            if isinstance(row, Fault):
                faulty += 1
                faults += [row] if faulty <= KEPT else []
        return Survey(total, faulty, tuple(faults))
