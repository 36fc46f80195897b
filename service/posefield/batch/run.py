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
from posefield.batch.target import STATE_FOLDER, open_target
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
    shard: Shard = Shard(),
    verify: bool = False,
) -> RunOutcome:
    """Make the unfinished chunks of a shard, and complete the export if those were all.

    verify: compare files of finished chunks by checksum, not only by size. Chunks with a file that
    differs are made again, as is a complete export. Raises InvalidField for invalid rows, unless
    they are skipped, and FileError if the target cannot be used; finished chunks are kept, and the
    next run resumes from there.
    """
    target, job = open_target(work.target), work.job
    if (facts := checkpoint.completed_facts(target, work)) is not None:
        # The run that completed it may have been killed before this.
        target.remove(STATE_FOLDER)
        if (path := checkpoint.first_damaged_file(target, facts, verify)) is None:
            rows = facts["clips"] + facts["skipped"]
            return RunOutcome(rows, rows, facts, already_complete=True)
        monitor.note(f"{work.target}/{path}: missing or damaged; the export is made again")
        checkpoint.reopen(target, job)
    misfit = _misfit(work)
    total = check_rows(source, work.skip, misfit)
    count = math.ceil(total / job.chunk)
    sizes = {
        number: min(job.chunk, total - number * job.chunk)
        for number in range(shard.index, count, shard.count)
    }
    rows = sum(sizes.values())
    try:
        checkpoint.assign_job(target, work)
        names = checkpoint.names(target)
        left = {
            number
            for number in sizes
            if checkpoint.finished_chunk(target, number, names, verify) is None
        }
        done = rows - sum(sizes[number] for number in left)
        monitor.begin(rows, done)
        tasks = _tasks(_checked_rows(source, misfit), job.chunk, left)
        for part in runner(work, tasks, monitor.stopped):
            done += part.clips + len(part.skipped)
            monitor.advance(part)
    except FileError:
        # Another run of the same export may have completed it meanwhile, or during the survey.
        if (facts := checkpoint.completed_facts(target, work)) is None:
            raise
        return RunOutcome(rows, rows, facts)
    return RunOutcome(rows, done, None if done < rows else checkpoint.finish(target, work, count))


def _tasks(
    rows: Iterator[ClipQuery | RowFault], size: int, numbers: set[int]
) -> Iterator[ChunkTask]:
    """Yield the tasks of some chunks of `size` rows, from one pass through the rows."""
    for number in range(max(numbers, default=-1) + 1):
        chunk = tuple(islice(rows, size))
        if number in numbers:
            yield ChunkTask(number, number * size, chunk)


Misfit = Callable[[ClipQuery], str | None]
"""Returns the reason for which a job cannot write a query, or None."""


def check_rows(source: RowSource, skip: bool, misfit: Misfit = lambda query: None) -> int:
    """Return the number of rows, each checked, without keeping any.

    Raises InvalidField for faults that are not skipped, or if all rows are faults.
    """
    total, faulty, faults = 0, 0, list[RowFault]()
    for row in _checked_rows(source, misfit):
        total += 1
        try:
            if isinstance(row, ClipQuery):
                source.check(row)
                continue
        except QueryError as fault:
            row = RowFault(row.place, str(fault))
        faulty += 1
        faults += [row] if faulty <= MAX_KEPT_FAULTS else []
    if faulty and not skip:
        raise chunks.invalid_rows_error(faulty, faults)
    if faulty == total:
        raise InvalidField("queries", "no row that can be answered, expected at least one")
    return total


def _checked_rows(source: RowSource, misfit: Misfit) -> Iterator[ClipQuery | RowFault]:
    """Yield the rows, with faults in place of the queries that the job cannot write."""
    for row in source.rows():
        why = misfit(row) if isinstance(row, ClipQuery) else None
        yield row if why is None else RowFault(row.place, why)


def _misfit(work: WorkerInput) -> Misfit:
    job = work.job
    if work.character is not None:
        chunks.check_character_layout(job.layout)
        return partial(chunks.character_misfit, work)
    misfit = layouts.find_layout(job.layout).misfit
    if misfit is None and (job.unit or job.up or job.body):
        misfit = _convention_misfit
    return (lambda query: None) if misfit is None else partial(misfit, job)


def _convention_misfit(job: ExportJob, query: ClipQuery) -> str | None:
    try:
        CLIP_ENCODERS[query.format].convention(job.unit, job.up, job.body)
    except InvalidField as fault:
        return str(fault)
    return None
