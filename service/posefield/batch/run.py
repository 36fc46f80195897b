"""One run of an export, from its queries to its target; an export may take several runs."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import islice
from typing import Any, Protocol

from posefield.batch import checkpoint, clip_files, layouts, process_pool
from posefield.batch.checkpoint import ChunkResult
from posefield.batch.clip_files import MAX_KEPT_FAULTS
from posefield.batch.job import WorkerInput
from posefield.batch.process_pool import Runner
from posefield.batch.rows import CheckedRow, Row, RowFault, RowReader
from posefield.batch.target import STATE_FOLDER, open_target
from posefield.common.errors import FileError, InvalidField, QueryError
from posefield.question.motion_question import ClipQuestion


class RunMonitor(Protocol):
    """Observer of a run, which also decides when to stop it."""

    def begin(self, total: int, done: int) -> None:
        """Begin a run; `done` of the `total` rows were finished by earlier runs."""

    def advance(self, result: ChunkResult) -> None:
        """Record a finished chunk."""

    def note(self, message: str) -> None:
        """Report an unexpected event to the user."""

    def stopped(self) -> bool:
        """Return whether the run should end; chunks in work are finished or abandoned."""


Misfit = Callable[[Row[ClipQuestion]], str | None]
"""Returns the reason for which a job cannot write a row, or None."""


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
    complete. already_complete: true if it was when this run began.
    """

    rows: int
    done: int
    facts: dict[str, Any] | None = None
    already_complete: bool = False


def run(
    work: WorkerInput,
    source: RowReader,
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
    if work.character is not None:
        check_character_layout(job.layout)
    total = check_rows(source, work.skip, partial(_misfit, work))
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
        pending = _chunks(_checked_rows(source, partial(_misfit, work)), job.chunk, left)
        for result in runner(partial(clip_files.make_chunk, work), pending, monitor.stopped):
            done += result.clips + len(result.skipped)
            monitor.advance(result)
    except FileError:
        # Another run of the same export may have completed it meanwhile, or during the survey.
        if (facts := checkpoint.completed_facts(target, work)) is None:
            raise
        return RunOutcome(rows, rows, facts)
    return RunOutcome(rows, done, None if done < rows else checkpoint.finish(target, work, count))


def _chunks(
    rows: Iterator[CheckedRow], size: int, numbers: set[int]
) -> Iterator[tuple[int, tuple[CheckedRow, ...]]]:
    """Yield number and rows of some chunks of `size` rows, from one pass through the rows."""
    for number in range(max(numbers, default=-1) + 1):
        chunk = tuple(islice(rows, size))
        if number in numbers:
            yield number, chunk


def check_rows(source: RowReader, skip: bool, misfit: Misfit = lambda row: None) -> int:
    """Return the number of rows, each checked, without keeping any.

    Raises InvalidField for faults that are not skipped, or if all rows are faults.
    """
    total, faulty, faults = 0, 0, list[RowFault]()
    for row in _checked_rows(source, misfit):
        total += 1
        try:
            if isinstance(row, Row):
                source.check(row)
                continue
        except QueryError as error:
            row = RowFault(row.place, str(error))
        faulty += 1
        faults += [row] if faulty <= MAX_KEPT_FAULTS else []
    if faulty and not skip:
        raise clip_files.invalid_rows_error(faulty, faults)
    if faulty == total:
        raise InvalidField("queries", "no row that can be answered, expected at least one")
    return total


def _checked_rows(source: RowReader, misfit: Misfit) -> Iterator[CheckedRow]:
    """Yield the rows, with faults in place of those that the job cannot write."""
    for row in source.rows():
        reason = misfit(row) if isinstance(row, Row) else None
        yield row if reason is None else RowFault(row.place, reason)


def _misfit(work: WorkerInput, row: Row[ClipQuestion]) -> str | None:
    """Return why the clip of a row cannot be written, or delivered to a character; else None."""
    reason = layouts.find_layout(work.job.layout).misfit(work.job, row)
    if reason is not None:
        return reason
    try:
        delivery = clip_files.clip_format(work, row.format).delivery
        if delivery is not None:
            delivery.character.check(row.question)
    except InvalidField as error:
        return str(error)
    return None


CHARACTER_LAYOUT = "folder"
"""Layout whose files refer to the file of a character."""


def check_character_layout(layout: str) -> None:
    """Raise InvalidField for a layout other than loose files.

    Those of an archive would refer to the character from wherever they are unpacked, and a library
    has the character of its model.
    """
    if layout != CHARACTER_LAYOUT:
        raise InvalidField(
            "layout",
            f"{layout!r} with a character, expected {CHARACTER_LAYOUT!r}: files refer to its file",
        )
