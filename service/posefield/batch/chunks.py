"""Chunks of an export: a range of rows of the queries, made into files.

`make(work, task)` is a pure function of the job and the rows, so a chunk can be made on any
machine, repeatedly or twice at once, with the same files. Its last step records the chunk's part of
the manifest.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from posefield.batch import checkpoint, layouts
from posefield.batch.checkpoint import ChunkResult
from posefield.batch.job import WorkerInput, manifest_entry, open_model_of
from posefield.batch.layouts import ClipFile, Layout, path
from posefield.batch.rows import ClipQuery, RowFault
from posefield.batch.target import open_target
from posefield.common.errors import InvalidField, QueryError
from posefield.encode.formats import CLIP_ENCODERS
from posefield.model_file.model_card import ModelCard
from posefield.question.results import ClipAnswer
from posefield.synthesis import clips, poses
from posefield.synthesis.synthesizer import Synthesizer

if TYPE_CHECKING:
    from posefield.characters.delivery import Delivery

MAX_KEPT_FAULTS = 20
"""Number of invalid rows that a message names."""
CLIPS, POSES = 128, 8192
"""Largest number of clips and poses in memory, except for a single longer clip: enough for files to
share data.
"""

StopCheck = Callable[[], bool]
"""Returns true when the work should stop."""


class ChunkAbandoned(Exception):
    """Raised when a chunk is abandoned because the work should stop."""


@dataclass(frozen=True)
class ChunkTask:
    """One chunk: its number, the index of its first row, and its rows in order."""

    number: int
    first: int
    rows: tuple[ClipQuery | RowFault, ...]


def make_chunk(
    work: WorkerInput, task: ChunkTask, stopped: StopCheck = lambda: False
) -> ChunkResult:
    """Make a chunk and return its result.

    Raises InvalidField, which names the rows at fault, unless they are skipped; FileError if the
    target cannot be written; Stop if the work should stop. None of these records a part.
    """
    target, layout = open_target(work.target), layouts.find_layout(work.job.layout)
    faults: list[RowFault] = []
    batches = _batches(work, layout, task, faults, stopped)
    entries, archives = layout.write(target, task.number, batches)
    if faults and not work.skip:
        raise invalid_rows_error(len(faults), faults)
    warned = sum(bool(entry["warnings"]) for entry in entries)
    size = sum(file.bytes for file in archives) or sum(entry["bytes"] for entry in entries)
    part = ChunkResult(len(entries), size, warned, faults, archives)
    checkpoint.record_chunk(target, task.number, part, entries)
    return part


def invalid_rows_error(count: int, faults: Sequence[RowFault]) -> InvalidField:
    """Return the error for invalid rows, with the first of them in its message.

    count: their number. faults: the known ones, at least the first KEPT.
    """
    listed = "".join(f"\n  {fault.place}: {fault.message}" for fault in faults[:MAX_KEPT_FAULTS])
    more = f"\n  and {count - MAX_KEPT_FAULTS} more" if count > MAX_KEPT_FAULTS else ""
    found = f"rows that cannot be answered: {count} (--skip-errors leaves them out)"
    return InvalidField("queries", f"{found}:{listed}{more}")


_Clip = tuple[str, ClipQuery, ClipAnswer]
"""Path, query and answer of a clip."""


def _batches(
    work: WorkerInput,
    layout: Layout,
    task: ChunkTask,
    faults: list[RowFault],
    stopped: StopCheck,
) -> Iterator[list[ClipFile]]:
    """Yield batches of files of the valid rows, in order; append the other rows to `faults`."""
    batch: list[_Clip] = []
    total = 0
    for clip in _synthesized_clips(work, task, faults):
        batch.append(clip)
        total += len(clip[2].clip)
        if len(batch) == CLIPS or total >= POSES:
            yield _files(work, layout, batch)
            batch, total = [], 0
            if stopped():
                raise ChunkAbandoned
    yield _files(work, layout, batch)


def _files(work: WorkerInput, layout: Layout, batch: list[_Clip]) -> list[ClipFile]:
    """Return the files of the clips; those of one format are encoded together."""
    job = work.job
    contents: dict[int, bytes] = {}
    for extension in dict.fromkeys(query.format for _, query, _ in batch):
        numbers = [index for index, (_, query, _) in enumerate(batch) if query.format == extension]
        answers = [batch[index][2] for index in numbers]
        if (order := delivery_of(work, extension)) is not None:
            files = [order.encode(answer) for answer in answers]
        else:
            convention = CLIP_ENCODERS[extension].convention(job.unit, job.up, job.body)
            files = layout.encode(extension)(answers, convention)
        contents |= zip(numbers, files, strict=True)
    return [
        ClipFile(
            file,
            contents[index],
            manifest_entry(query.name, file, contents[index], answer)
            | layout.describe(query.name, file, answer),
        )
        for index, (file, query, answer) in enumerate(batch)
    ]


def _synthesized_clips(
    work: WorkerInput, task: ChunkTask, faults: list[RowFault]
) -> Iterator[_Clip]:
    model = open_model_of(work)
    for block in _blocks(model, task):
        questions = [row.question for _, row in block if isinstance(row, ClipQuery)]
        answers = iter(clips.synthesize_clips(model, questions))
        for number, row in block:
            if isinstance(row, ClipQuery):
                try:
                    answer = _delivered(work, model, row, next(answers))
                except QueryError as error:
                    row = RowFault(row.place, str(error))
                else:
                    yield path(number, row.name, row.format), row, answer
                    continue
            # The table's folder is not part of the job and must not affect its files.
            faults.append(RowFault(row.place.rpartition("/")[2], row.message))


def _blocks(
    model: Synthesizer, task: ChunkTask
) -> Iterator[list[tuple[int, ClipQuery | RowFault]]]:
    """Yield the rows with their indices, in blocks that are synthesised together."""
    longest, (slowest, fastest) = model.session.bounds.duration_limits[1], poses.FPS_RANGE
    block: list[tuple[int, ClipQuery | RowFault]] = []
    total = 0.0
    for number, row in enumerate(task.rows, task.first):
        # A rate that is refused has no frames.
        rate = row.question.fps if isinstance(row, ClipQuery) else 0.0
        frames = rate * longest if slowest <= rate <= fastest else 0.0
        if block and (len(block) == CLIPS or total + frames > POSES):
            yield block
            block, total = [], 0.0
        block.append((number, row))
        total += frames
    yield block


def _delivered(
    work: WorkerInput, model: Synthesizer, query: ClipQuery, answer: ClipAnswer | QueryError
) -> ClipAnswer:
    """Return the clip of a query; raises QueryError for one that cannot be delivered."""
    if isinstance(answer, QueryError):
        raise answer
    if (order := delivery_of(work, query.format)) is not None:
        answer = order.clip(answer, query.question, model.session.card.roles)
    return CLIP_ENCODERS[query.format].noted(answer)


CHARACTER_LAYOUT = "folder"
"""Layout whose files refer to the file of a character."""
CHARACTER_FOLDER = layouts.path(0, "", "").rpartition("/")[0]
"""Folder of the first clips in a target; those of all clips are as deep."""


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


def check_character_model(card: ModelCard) -> None:
    """Raise InvalidField for a model whose clips cannot be retargeted."""
    # Modules that only exports for a character need.
    from posefield.retarget import role_map

    role_map.body_of_motion(card.skeleton, card.skeleton.offsets, card.roles)


def delivery_of(work: WorkerInput, extension: str) -> "Delivery | None":
    """Return the delivery to the character of an export in a format; None without a character.

    Raises InvalidField for what files of the format cannot hold.
    """
    if work.character is None:
        return None
    # Modules that only exports for a character need.
    from posefield.characters import delivery

    return delivery.deliver(work.character, CLIP_ENCODERS[extension], work.job)


def character_misfit(work: WorkerInput, query: ClipQuery) -> str | None:
    """Return why the clip of a query cannot be delivered to the character; None if it can."""
    try:
        order = delivery_of(work, query.format)
        if order is not None:
            order.character.target.check(query.question)
    except InvalidField as fault:
        return str(fault)
    return None
