"""An export from its queries to its target, in as many goes as it takes."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from typing import Any, Protocol

from service.export import chunks, crew, fitting, ledger
from service.export.chunks import Task
from service.export.crew import Crew
from service.export.job import Work
from service.export.ledger import Part
from service.export.query import Source
from service.export.target import STATE, Target, open_target
from service.motion.errors import FileError, InvalidField


class Watch(Protocol):
    """Whoever looks on: is told how it goes, and says when to stop."""

    def begin(self, total: int, done: int) -> None:
        """Of so many rows so many were done before."""

    def advance(self, part: Part) -> None:
        """A chunk is done."""

    def stopped(self) -> bool:
        """Whether to put away what was begun, and end."""


@dataclass(frozen=True)
class Shard:
    """The chunks whose number leaves `index` when divided by `count`."""

    index: int = 0
    count: int = 1

    def __post_init__(self) -> None:
        if not 0 <= self.index < self.count:
            raise InvalidField("shard", f"{self.index}/{self.count}, expected 0/N to N-1/N")

    @classmethod
    def of(cls, words: str) -> "Shard":
        """Shard of I/N."""
        index, _, count = words.partition("/")
        try:
            return cls(int(index), int(count))
        except ValueError as fault:
            raise InvalidField("shard", f"{words!r}, expected I/N, such as 0/4") from fault

    def has(self, number: int) -> bool:
        """Whether a chunk is of it."""
        return number % self.count == self.index


WHOLE = Shard()


@dataclass(frozen=True)
class Outcome:
    """What came of a run: rows of its shard, and how many of them are done by now.

    facts: of the whole export, once it is complete; before: whether it was when this run began.
    """

    rows: int
    done: int
    facts: dict[str, Any] | None = None
    before: bool = False


def run(
    work: Work, source: Source, watch: Watch, by: Crew = crew.alone, shard: Shard = WHOLE
) -> Outcome:
    """Do what is left of a shard of an export, and complete the export if that was all of it.

    Raises InvalidField for rows at fault, unless they are skipped, and FileError where the target
    cannot be used; what is done by then stays, and the next run goes on from there.
    """
    target = open_target(work.target)
    if (facts := ledger.complete(target, work.target, work.job)) is not None:
        # Whoever completed it may have been killed before this.
        target.remove(STATE)
        if ledger.whole(target):
            rows = facts["clips"] + facts["skipped"]
            return Outcome(rows, rows, facts, before=True)
        ledger.reopen(target, work.job)
    source = fitting.to(work.job, source)
    total = _survey(source, work.skip)
    return _go_on(_Run(work, source, target, shard, total), watch, by)


@dataclass(frozen=True)
class _Run:
    work: Work
    source: Source
    target: Target
    shard: Shard
    total: int

    @property
    def size(self) -> int:
        return self.work.job.chunk

    @property
    def chunks(self) -> int:
        return math.ceil(self.total / self.size)

    @property
    def own(self) -> dict[int, int]:
        """Rows of each chunk of the shard, by its number."""
        numbers = filter(self.shard.has, range(self.chunks))
        return {number: min(self.size, self.total - number * self.size) for number in numbers}

    def tasks(self, numbers: set[int]) -> Iterator[Task]:
        """Tasks of the chunks of these numbers, from one pass through the queries."""
        rows = self.source.rows()
        for number in range(max(numbers, default=-1) + 1):
            chunk = tuple(islice(rows, self.size))
            if number in numbers:
                yield Task(number, number * self.size, chunk)

    def finish(self) -> dict[str, Any] | None:
        return ledger.finish(self.target, self.work, self.chunks)


def _go_on(run: _Run, watch: Watch, by: Crew) -> Outcome:
    own = run.own
    rows = sum(own.values())
    try:
        ledger.begin(run.target, run.work.target, run.work.job)
        names = ledger.names(run.target)
        left = {number for number in own if ledger.done(run.target, number, names) is None}
        done = rows - sum(own[number] for number in left)
        watch.begin(rows, done)
        for part in by(run.work, run.tasks(left), watch.stopped):
            done += part.clips + len(part.skipped)
            watch.advance(part)
    except FileError:
        # Another run of the same export may have completed it meanwhile, or during the survey.
        if (facts := ledger.complete(run.target, run.work.target, run.work.job)) is None:
            raise
        return Outcome(rows, rows, facts)
    return Outcome(rows, done, None if done < rows else run.finish())


def _survey(source: Source, skip: bool) -> int:
    """Number of rows; InvalidField where some are at fault and not to be skipped, or none is."""
    found = source.survey()
    if found.faulty and not skip:
        raise chunks.refusal(found.faulty, found.faults)
    if found.faulty == found.total:
        raise InvalidField("queries", "no row that can be answered, expected at least one")
    return found.total
