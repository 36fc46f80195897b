"""Rows that are sound but have no place in the layout asked for."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import islice

from service.export import layouts
from service.export.job import Job
from service.export.query import KEPT, Fault, Query, Source, Survey


def to(job: Job, source: Source) -> Source:
    """The source, with faults instead of queries that have no place in the job's layout."""
    misfit = layouts.find(job.layout).misfit
    return source if misfit is None else Fitting(source, job, misfit)


@dataclass(frozen=True)
class Fitting:
    """Rows of a source, of which some have no place for a reason that `misfit` gives."""

    source: Source
    job: Job
    misfit: Callable[[Job, Query], str | None]

    @property
    def digest(self) -> str:
        """Of the source: the layout is the job's."""
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
        """What the source finds, and all that has no place."""
        found = self.source.survey()
        faulty = sum(isinstance(row, Fault) for row in self.rows())
        faults = (row for row in self.rows() if isinstance(row, Fault))
        return Survey(found.total, faulty, tuple(islice(faults, KEPT)) if faulty else ())
