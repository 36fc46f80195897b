"""One run of an export, from its queries to its target; an export may take several runs."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import islice
from typing import Any, Protocol

from posefield.batch import checkpoint, chunks, layouts, process_pool
from posefield.batch.checkpoint import Part
from posefield.batch.chunks import Task
from posefield.batch.job import Job, Work
from posefield.batch.process_pool import Runner
from posefield.batch.rows.row_query import KEPT, Fault, Query, Source, Survey
from posefield.batch.target import STATE, Target, open_target
from posefield.common.errors import FileError, InvalidField
from posefield.encode.formats import ENCODERS


class Monitor(Protocol):
    """Observer of a run, which also decides when to stop it."""

    def begin(self, total: int, done: int) -> None:
        """Begin a run; `done` of the `total` rows were finished by earlier runs."""

    def advance(self, part: Part) -> None:
        """Record a finished chunk."""

    def note(self, message: str) -> None:
        """Report an unexpected event to the user."""

    def stopped(self) -> bool:
        """Return whether the run should end; chunks in work are finished or abandoned."""


@dataclass(frozen=True)
class Shard:
    """The chunks whose number leaves the remainder `index` when divided by `count`."""

    index: int = 0
    count: int = 1

    def __post_init__(self) -> None:
        if not 0 <= self.index < self.count:
            raise InvalidField("shard", f"{self.index}/{self.count}, expected 0/N to N-1/N")

    @classmethod
    def of(cls, text: str) -> "Shard":
        """Return the shard of the text I/N; InvalidField for any other."""
        index, _, count = text.partition("/")
        try:
            return cls(int(index), int(count))
        except ValueError as fault:
            raise InvalidField("shard", f"{text!r}, expected I/N, such as 0/4") from fault

    def has(self, number: int) -> bool:
        """Return whether a chunk belongs to the shard."""
        return number % self.count == self.index


WHOLE = Shard()


@dataclass(frozen=True)
class Outcome:
    """Result of a run.

    rows: of the shard. done: how many of them are finished. facts: of the whole export if it is
    complete. before: true if it was complete when this run began.
    """

    rows: int
    done: int
    facts: dict[str, Any] | None = None
    before: bool = False


def run(
    work: Work,
    source: Source,
    monitor: Monitor,
    runner: Runner = process_pool.run_here,
    shard: Shard = WHOLE,
    verify: bool = False,
) -> Outcome:
    """Make the unfinished chunks of a shard, and complete the export if those were all.

    verify: compare files of finished chunks by checksum, not only by size. Chunks with a file that
    differs are made again, as is a complete export. Raises InvalidField for invalid rows, unless
    they are skipped, and FileError if the target cannot be used; finished chunks are kept, and the
    next run resumes from there.
    """
    target = open_target(work.target)
    if (facts := checkpoint.complete(target, work.target, work.job)) is not None:
        # The run that completed it may have been killed before this.
        target.remove(STATE)
        if (path := checkpoint.damaged(target, facts, verify)) is None:
            rows = facts["clips"] + facts["skipped"]
            return Outcome(rows, rows, facts, before=True)
        monitor.note(f"{work.target}/{path}: missing or damaged; the export is made again")
        checkpoint.reopen(target, work.job)
    source = _fitting(work.job, source)
    total = _survey(source, work.skip)
    return _resume(_Run(work, source, target, shard, total, verify), monitor, runner)


@dataclass(frozen=True)
class _Run:
    work: Work
    source: Source
    target: Target
    shard: Shard
    total: int
    verify: bool

    @property
    def size(self) -> int:
        return self.work.job.chunk

    @property
    def chunks(self) -> int:
        return math.ceil(self.total / self.size)

    @property
    def own(self) -> dict[int, int]:
        """Number of rows of each chunk of the shard, by the number of the chunk."""
        numbers = filter(self.shard.has, range(self.chunks))
        return {number: min(self.size, self.total - number * self.size) for number in numbers}

    def unfinished(self) -> set[int]:
        """Return the numbers of the shard's chunks that have to be made."""
        names = checkpoint.names(self.target)
        return {
            number
            for number in self.own
            if checkpoint.done(self.target, number, names, self.verify) is None
        }

    def tasks(self, numbers: set[int]) -> Iterator[Task]:
        """Yield the tasks of some chunks, from one pass through the queries."""
        rows = self.source.rows()
        for number in range(max(numbers, default=-1) + 1):
            chunk = tuple(islice(rows, self.size))
            if number in numbers:
                yield Task(number, number * self.size, chunk)

    def finish(self) -> dict[str, Any] | None:
        return checkpoint.finish(self.target, self.work, self.chunks)


def _resume(run: _Run, monitor: Monitor, runner: Runner) -> Outcome:
    own = run.own
    rows = sum(own.values())
    try:
        checkpoint.begin(run.target, run.work.target, run.work.job)
        left = run.unfinished()
        done = rows - sum(own[number] for number in left)
        monitor.begin(rows, done)
        for part in runner(run.work, run.tasks(left), monitor.stopped):
            done += part.clips + len(part.skipped)
            monitor.advance(part)
    except FileError:
        # Another run of the same export may have completed it meanwhile, or during the survey.
        if (facts := checkpoint.complete(run.target, run.work.target, run.work.job)) is None:
            raise
        return Outcome(rows, rows, facts)
    return Outcome(rows, done, None if done < rows else run.finish())


def _survey(source: Source, skip: bool) -> int:
    """Return the number of rows.

    Raises InvalidField for faults that are not skipped, or if all rows are faults.
    """
    found = source.survey()
    if found.faulty and not skip:
        raise chunks.refusal(found.faulty, found.faults)
    if found.faulty == found.total:
        raise InvalidField("queries", "no row that can be answered, expected at least one")
    return found.total


def _fitting(job: Job, source: Source) -> Source:
    """Return the source with faults in place of the queries that the job cannot write."""
    misfit = layouts.find(job.layout).misfit
    if misfit is None and (job.unit or job.up):
        misfit = _unlawful
    return source if misfit is None else _Fitting(source, job, misfit)


def _unlawful(job: Job, query: Query) -> str | None:
    """Return the reason for which a format cannot have the job's unit and up axis, or None."""
    try:
        ENCODERS[query.format].convention(job.unit, job.up)
    except InvalidField as fault:
        return str(fault)
    return None


@dataclass(frozen=True)
class _Fitting:
    """Rows of a source; those for which `misfit` returns a reason are faults."""

    source: Source
    job: Job
    misfit: Callable[[Job, Query], str | None]

    @property
    def digest(self) -> str:
        # The reasons depend on the job, which has a digest of its own.
        return self.source.digest

    def rows(self) -> Iterator[Query | Fault]:
        for row in self.source.rows():
            why = self.misfit(self.job, row) if isinstance(row, Query) else None
            yield row if why is None else Fault(row.place, why)

    def survey(self) -> Survey:
        total, faulty, faults = 0, 0, []
        for row in self.rows():
            total += 1
            if isinstance(row, Fault):
                faulty += 1
                faults += [row] if faulty <= KEPT else []
        return Survey(total, faulty, tuple(faults))
