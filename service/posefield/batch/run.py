"""One run of an export, from its queries to its target; an export may take several runs."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import islice
from typing import Any, Protocol

from posefield.batch import checkpoint, chunks, layouts, process_pool
from posefield.batch.checkpoint import ChunkResult
from posefield.batch.chunks import MAX_KEPT_FAULTS, ChunkTask
from posefield.batch.job import ExportJob, WorkerInput
from posefield.batch.process_pool import Runner
from posefield.batch.rows import ClipQuery, RowFault, RowSource
from posefield.batch.target import STATE_FOLDER, ExportTarget, open_target
from posefield.common.errors import FileError, InvalidField, QueryError
from posefield.encode.formats import CLIP_ENCODERS


class RunMonitor(Protocol):
    """Observer of a run, which also decides when to stop it."""

    def begin(self, total: int, done: int) -> None:
        """Begin a run; `done` of the `total` rows were finished by earlier runs."""

    def advance(self, part: ChunkResult) -> None:
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
    def parse(cls, text: str) -> "Shard":
        """Return the shard of the text I/N; InvalidField for any other."""
        index, _, count = text.partition("/")
        try:
            return cls(int(index), int(count))
        except ValueError as fault:
            raise InvalidField("shard", f"{text!r}, expected I/N, such as 0/4") from fault

    def contains(self, number: int) -> bool:
        """Return whether a chunk belongs to the shard."""
        return number % self.count == self.index


WHOLE_EXPORT = Shard()


@dataclass(frozen=True)
class RunOutcome:
    """Result of a run.

    rows: of the shard. done: how many of them are finished. facts: of the whole export if it is
    complete. before: true if it was complete when this run began.
    """

    rows: int
    done: int
    facts: dict[str, Any] | None = None
    already_complete: bool = False


def run(
    work: WorkerInput,
    source: RowSource,
    monitor: RunMonitor,
    runner: Runner = process_pool.run_here,
    shard: Shard = WHOLE_EXPORT,
    verify: bool = False,
) -> RunOutcome:
    """Make the unfinished chunks of a shard, and complete the export if those were all.

    verify: compare files of finished chunks by checksum, not only by size. Chunks with a file that
    differs are made again, as is a complete export. Raises InvalidField for invalid rows, unless
    they are skipped, and FileError if the target cannot be used; finished chunks are kept, and the
    next run resumes from there.
    """
    target = open_target(work.target)
    if (facts := checkpoint.completed_facts(target, work.target, work.job)) is not None:
        # The run that completed it may have been killed before this.
        target.remove(STATE_FOLDER)
        if (path := checkpoint.first_damaged_file(target, facts, verify)) is None:
            rows = facts["clips"] + facts["skipped"]
            return RunOutcome(rows, rows, facts, already_complete=True)
        monitor.note(f"{work.target}/{path}: missing or damaged; the export is made again")
        checkpoint.reopen(target, work.job)
    source = _checked_source(work, source)
    total = check_rows(source, work.skip)
    return _resume(_ShardRun(work, source, target, shard, total, verify), monitor, runner)


@dataclass(frozen=True)
class _ShardRun:
    work: WorkerInput
    source: RowSource
    target: ExportTarget
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
    def chunk_sizes(self) -> dict[int, int]:
        """Number of rows of each chunk of the shard, by the number of the chunk."""
        numbers = filter(self.shard.contains, range(self.chunks))
        return {number: min(self.size, self.total - number * self.size) for number in numbers}

    def unfinished(self) -> set[int]:
        """Return the numbers of the shard's chunks that have to be made."""
        names = checkpoint.names(self.target)
        return {
            number
            for number in self.chunk_sizes
            if checkpoint.finished_chunk(self.target, number, names, self.verify) is None
        }

    def tasks(self, numbers: set[int]) -> Iterator[ChunkTask]:
        """Yield the tasks of some chunks, from one pass through the queries."""
        rows = self.source.rows()
        for number in range(max(numbers, default=-1) + 1):
            chunk = tuple(islice(rows, self.size))
            if number in numbers:
                yield ChunkTask(number, number * self.size, chunk)

    def finish(self) -> dict[str, Any] | None:
        return checkpoint.finish(self.target, self.work, self.chunks)


def _resume(run: _ShardRun, monitor: RunMonitor, runner: Runner) -> RunOutcome:
    own = run.chunk_sizes
    rows = sum(own.values())
    try:
        checkpoint.assign_job(run.target, run.work.target, run.work.job)
        left = run.unfinished()
        done = rows - sum(own[number] for number in left)
        monitor.begin(rows, done)
        for part in runner(run.work, run.tasks(left), monitor.stopped):
            done += part.clips + len(part.skipped)
            monitor.advance(part)
    except FileError:
        # Another run of the same export may have completed it meanwhile, or during the survey.
        if (facts := checkpoint.completed_facts(run.target, run.work.target, run.work.job)) is None:
            raise
        return RunOutcome(rows, rows, facts)
    return RunOutcome(rows, done, None if done < rows else run.finish())


def check_rows(source: RowSource, skip: bool) -> int:
    """Return the number of rows, each checked, without keeping any.

    Raises InvalidField for faults that are not skipped, or if all rows are faults.
    """
    total, faulty, faults = 0, 0, list[RowFault]()
    for row in source.rows():
        total += 1
        fault = row if isinstance(row, RowFault) else _fault(source, row)
        if fault is not None:
            faulty += 1
            faults += [fault] if faulty <= MAX_KEPT_FAULTS else []
    if faulty and not skip:
        raise chunks.invalid_rows_error(faulty, faults)
    if faulty == total:
        raise InvalidField("queries", "no row that can be answered, expected at least one")
    return total


def _fault(source: RowSource, query: ClipQuery) -> RowFault | None:
    """Return the fault of a row without an answer, as far as it is known; None for another."""
    try:
        source.check(query)
    except QueryError as fault:
        return RowFault(query.place, str(fault))
    return None


def _checked_source(work: WorkerInput, source: RowSource) -> RowSource:
    """Return the source with faults in place of the queries that the job cannot write."""
    job = work.job
    if work.character is not None:
        chunks.check_character_layout(job.layout)
        return _CheckedSource(source, lambda query: chunks.character_misfit(work, query))
    misfit = layouts.find_layout(job.layout).misfit
    if misfit is None and (job.unit or job.up or job.body):
        misfit = _convention_misfit
    return source if misfit is None else _CheckedSource(source, partial(misfit, job))


def _convention_misfit(job: ExportJob, query: ClipQuery) -> str | None:
    """Return why a format cannot have the unit, up axis and body of a job; None if it can."""
    try:
        CLIP_ENCODERS[query.format].convention(job.unit, job.up, job.body)
    except InvalidField as fault:
        return str(fault)
    return None


@dataclass(frozen=True)
class _CheckedSource:
    """Rows of a source; those for which `misfit` returns a reason are faults."""

    source: RowSource
    misfit: Callable[[ClipQuery], str | None]

    @property
    def digest(self) -> str:
        # The reasons depend on the job, which has a digest of its own.
        return self.source.digest

    def rows(self) -> Iterator[ClipQuery | RowFault]:
        for row in self.source.rows():
            why = self.misfit(row) if isinstance(row, ClipQuery) else None
            yield row if why is None else RowFault(row.place, why)

    def check(self, query: ClipQuery) -> None:
        self.source.check(query)
