"""Files of clips: of archives that are sent as they are made, and of the chunks of an export.

`make_chunk(work, chunk)` is a pure function of the job and the rows, so a chunk can be made on any
machine, repeatedly or twice at once, with the same files. Its last step records the chunk's part of
the manifest.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

from posefield.batch import checkpoint, layouts
from posefield.batch.checkpoint import ChunkResult
from posefield.batch.job import ExportedFile, WorkerInput, exported_file, open_model_of
from posefield.batch.rows import CheckedRow, Row, RowFault
from posefield.batch.target import open_target
from posefield.common import cancellation
from posefield.common.errors import FileError, InvalidField, QueryError
from posefield.encode.character import Convention
from posefield.encode.formats import ALL_ENCODERS, ClipEncoder, left_out
from posefield.question.motion_question import ClipQuestion
from posefield.question.results import ClipAnswer
from posefield.synthesis import clip_draft, clips
from posefield.synthesis.clips import ClipPreview
from posefield.synthesis.synthesizer import Synthesizer

if TYPE_CHECKING:
    from posefield.characters.delivery import Delivery

SENT_CLIPS, SENT_POSES = 16, 4096
"""Largest number of clips and poses of a batch of an archive, except for a single longer clip."""
CLIPS, POSES = 128, 8192
"""The same for exports to files: enough for files to share data."""
MAX_KEPT_FAULTS = 20
"""Number of invalid rows that a message names."""


@dataclass(frozen=True)
class ClipFormat:
    """Format of the files of clips.

    delivery: to a character of a user; None for that of the model.
    """

    encoder: ClipEncoder
    convention: Convention
    delivery: "Delivery | None" = None

    def deliver(
        self, model: Synthesizer, question: ClipQuestion, answer: ClipAnswer | QueryError
    ) -> ClipAnswer:
        """Return the clip as its file has it; raises QueryError for one that cannot be."""
        if isinstance(answer, QueryError):
            raise answer
        if self.delivery is not None:
            answer = self.delivery.clip(answer, question, model.session.card.roles)
        return self.encoder.noted(answer)

    def encode(self, answers: Sequence[ClipAnswer]) -> list[bytes]:
        """Return the files of several clips, which are encoded together."""
        if self.delivery is not None:
            return [self.delivery.encode(answer) for answer in answers]
        return self.encoder.write(answers, self.convention)


@dataclass(frozen=True)
class ArchiveOrder:
    """Validated clips of one format.

    previews: frames and warnings of each, known before synthesis.
    """

    model: Synthesizer
    format: ClipFormat
    rows: Sequence[Row[ClipQuestion]]
    previews: Sequence[ClipPreview]

    @property
    def warnings(self) -> list[str]:
        """Warnings with the number of clips that extrapolate and of clips that miss a target.

        The manifest has the warnings of each clip.
        """
        counts = {
            "lie outside what was sampled, or in a gap of it": sum(
                bool(preview.warnings) for preview in self.previews
            ),
            "miss some target": sum(preview.misses_target for preview in self.previews),
        }
        total, encoder = len(self.previews), self.format.encoder
        warnings = [f"{count} of {total} clips {text}" for text, count in counts.items() if count]
        curves = [curve.name for curve in self.model.session.card.curves]
        if curves and not encoder.has_curves:
            warnings.append(left_out(curves, encoder.extension))
        return warnings

    def files(self) -> Iterator[ExportedFile]:
        """Yield the file of each clip; a batch is made when its first file is requested."""
        frames = [preview.frames for preview in self.previews]
        for batch in batches(frames, SENT_CLIPS, SENT_POSES):
            rows, answers = self.rows[batch], []
            questions = [row.question for row in rows]
            for row, answer in zip(
                rows, clips.synthesize_clips(self.model, questions), strict=True
            ):
                cancellation.check()
                answers.append(self.format.deliver(self.model, row.question, answer))
            contents = self.format.encode(answers)
            for row, content, delivered in zip(rows, contents, answers, strict=True):
                yield exported_file(row.name, f"{row.name}.{row.format}", delivered, content)


def batches(frames: Sequence[float], clips: int, poses: int) -> Iterator[slice]:
    """Yield slices of clips of these numbers of frames that are made together."""
    first, total = 0, 0.0
    for index, count in enumerate(frames):
        if index > first and (index == first + clips or total + count > poses):
            yield slice(first, index)
            first, total = index, 0.0
        total += count
    yield slice(first, len(frames))


def make_chunk(work: WorkerInput, chunk: tuple[int, Sequence[CheckedRow]]) -> ChunkResult:
    """Make a chunk and return its result. chunk: its number, and its rows in order.

    Raises InvalidField, which names the rows at fault, unless they are skipped; FileError if the
    target is not that of the job, or cannot be written; Cancelled if the work should stop. None of
    these records a part.
    """
    (number, rows), target, layout = chunk, open_target(work.target), work.job.layout
    if target.read(checkpoint.JOB) is None:
        expected = "expected a folder that all machines share, or an object store's URL"
        raise FileError(work.target, f"holds no export on a worker; {expected}")
    faults: list[RowFault] = []
    files = _chunk_files(work, number * work.job.chunk, rows, faults)
    entries, archives = layouts.find_layout(layout).write(target, number, files)
    if faults and not work.skip:
        raise invalid_rows_error(len(faults), faults)
    warned = sum(bool(entry["warnings"]) for entry in entries)
    size = sum(file.bytes for file in archives) or sum(entry["bytes"] for entry in entries)
    result = ChunkResult(len(entries), size, warned, faults, archives)
    checkpoint.record_chunk(target, number, result, entries)
    return result


def invalid_rows_error(count: int, faults: Sequence[RowFault]) -> InvalidField:
    """Return the error for invalid rows, with the first of them in its message.

    count: their number. faults: the known ones, at least the first MAX_KEPT_FAULTS.
    """
    listed = "".join(f"\n  {fault.place}: {fault.message}" for fault in faults[:MAX_KEPT_FAULTS])
    more = f"\n  and {count - MAX_KEPT_FAULTS} more" if count > MAX_KEPT_FAULTS else ""
    summary = f"rows that cannot be answered: {count} (--skip-errors leaves them out)"
    return InvalidField("queries", f"{summary}:{listed}{more}")


def _chunk_files(
    work: WorkerInput,
    first: int,
    rows: Sequence[CheckedRow],
    faults: list[RowFault],
) -> Iterator[list[ExportedFile]]:
    """Yield batches of files of the valid rows, in order; append the other rows to `faults`."""
    model = open_model_of(work)
    for batch in batches([_longest(model, row) for row in rows], CLIPS, POSES):
        cancellation.check()
        valid: list[tuple[str, Row[ClipQuestion], ClipAnswer]] = []
        questions = [row.question for row in rows[batch] if isinstance(row, Row)]
        answers = iter(clips.synthesize_clips(model, questions))
        for index, row in enumerate(rows[batch], first + batch.start):
            if isinstance(row, Row):
                try:
                    form = clip_format(work, row.format)
                    answer = form.deliver(model, row.question, next(answers))
                except QueryError as error:
                    row = RowFault(row.place, str(error))
                else:
                    valid.append((layouts.path(index, row.name, row.format), row, answer))
                    continue
            # The table's folder is not part of the job and must not affect its files.
            faults.append(RowFault(row.place.rpartition("/")[2], row.message))
        yield _encode(work, valid)


def _longest(model: Synthesizer, row: CheckedRow) -> float:
    """Return an upper bound of the number of frames of a row's clip."""
    slowest, fastest = clip_draft.FPS_RANGE
    if isinstance(row, RowFault) or not slowest <= row.question.fps <= fastest:
        # A rate that is refused has no frames.
        return 0.0
    return row.question.fps * model.session.bounds.duration_limits[1]


def _encode(
    work: WorkerInput, rows: Sequence[tuple[str, Row[ClipQuestion], ClipAnswer]]
) -> list[ExportedFile]:
    """Return the files of clips, of which those of one format are encoded together."""
    contents: dict[int, bytes] = {}
    for extension in dict.fromkeys(row.format for _, row, _ in rows):
        indices = [index for index, (_, row, _) in enumerate(rows) if row.format == extension]
        answers = [rows[index][2] for index in indices]
        contents |= zip(indices, clip_format(work, extension).encode(answers), strict=True)
    describe = layouts.find_layout(work.job.layout).describe
    files = []
    for index, (path, row, answer) in enumerate(rows):
        file = exported_file(row.name, path, answer, contents[index])
        files.append(replace(file, entry=file.entry | describe(answer)))
    return files


@lru_cache(maxsize=len(ALL_ENCODERS))
def clip_format(work: WorkerInput, extension: str) -> ClipFormat:
    """Return the format of the files of an export with this extension.

    Raises InvalidField for what files of the format cannot hold.
    """
    encoder, job = ALL_ENCODERS[extension], work.job
    if work.character is not None:
        # Modules that only exports for a character need.
        from posefield.characters import delivery

        order = delivery.deliver(work.character, encoder, job)
        return ClipFormat(encoder, order.convention, order)
    if encoder.is_humanoid:
        card = open_model_of(work).session.card
        encoder.check_body(card.skeleton, card.roles)
    write = layouts.find_layout(job.layout).encode
    encoder = encoder if write is None else replace(encoder, write=write)
    return ClipFormat(encoder, encoder.convention(job.unit, job.up, job.body))
