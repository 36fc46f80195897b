"""Chunks of an export: a range of rows of the queries, made into files.

`make(work, task)` is a pure function of the job and the rows, so a chunk can be made on any
machine, repeatedly or twice at once, with the same files. Its last step records the chunk's part of
the manifest.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from posefield.batch import checkpoint, layouts, manifest
from posefield.batch.checkpoint import ChunkResult
from posefield.batch.job import WorkerInput, open_model_of
from posefield.batch.layouts import ClipFile, Layout, ManifestEntry, path
from posefield.batch.rows import ClipQuery, RowFault
from posefield.batch.target import open_target
from posefield.common.errors import InvalidField, QueryError
from posefield.encode.formats import CLIP_ENCODERS
from posefield.model_file.model_card import ModelCard
from posefield.question.results import ClipAnswer
from posefield.synthesis import clips, frame_times
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
    target = open_target(work.target)
    layout = layouts.find_layout(work.job.layout)
    chunk = _ChunkInProgress(work, layout, open_model_of(work), task, [])
    entries, archives = layout.write(target, task.number, chunk.batches(stopped))
    if chunk.faults and not work.skip:
        raise invalid_rows_error(len(chunk.faults), chunk.faults)
    warned = sum(bool(entry["warnings"]) for entry in entries)
    size = sum(file.bytes for file in archives) or sum(entry["bytes"] for entry in entries)
    part = ChunkResult(len(entries), size, warned, chunk.faults, archives)
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


@dataclass(frozen=True)
class _SynthesizedClip:
    path: str
    query: ClipQuery
    answer: ClipAnswer


@dataclass(frozen=True)
class _ChunkInProgress:
    """A chunk in progress. faults: those found so far."""

    work: WorkerInput
    layout: Layout
    synthesizer: Synthesizer
    task: ChunkTask
    faults: list[RowFault]

    def batches(self, stopped: StopCheck) -> Iterator[list[ClipFile]]:
        """Yield batches of files of the valid rows, in order."""
        made: list[_SynthesizedClip] = []
        poses = 0
        for one in self._synthesized_clips():
            made.append(one)
            poses += len(one.answer.clip)
            if len(made) == CLIPS or poses >= POSES:
                yield self._files(made)
                made, poses = [], 0
                if stopped():
                    raise ChunkAbandoned
        yield self._files(made)

    def _files(self, made: list[_SynthesizedClip]) -> list[ClipFile]:
        contents = self._contents(made)
        return [
            ClipFile(one.path, content, self._entry(one, content))
            for one, content in zip(made, contents, strict=True)
        ]

    def _entry(self, one: _SynthesizedClip, content: bytes) -> ManifestEntry:
        said = manifest.entry(one.query.name, one.path, content, one.answer)
        return said | self.layout.describe(one.query.name, one.path, one.answer)

    def _synthesized_clips(self) -> Iterator[_SynthesizedClip]:
        for block in self._blocks():
            queries = [row for _, row in block if isinstance(row, ClipQuery)]
            answers = iter(
                clips.synthesize_clips(self.synthesizer, [row.question for row in queries])
            )
            for number, row in block:
                if isinstance(row, RowFault):
                    self._record_fault(row.place, row.message)
                    continue
                answer = next(answers)
                try:
                    made = self._synthesized(number, row, answer)
                except QueryError as fault:
                    self._record_fault(row.place, str(fault))
                else:
                    yield made

    def _blocks(self) -> Iterator[list[tuple[int, ClipQuery | RowFault]]]:
        """Yield the rows with their indices, in blocks that are synthesised together."""
        block: list[tuple[int, ClipQuery | RowFault]] = []
        poses = 0.0
        for number, row in enumerate(self.task.rows, self.task.first):
            frames = self._most_frames(row) if isinstance(row, ClipQuery) else 0.0
            if block and (len(block) == CLIPS or poses + frames > POSES):
                yield block
                block, poses = [], 0.0
            block.append((number, row))
            poses += frames
        yield block

    def _most_frames(self, query: ClipQuery) -> float:
        """Return the number of frames of the longest clip; 0 for a rate that is refused."""
        rate, longest = query.question.fps, self.synthesizer.session.bounds.duration_limits[1]
        slowest, fastest = frame_times.FPS_RANGE
        return rate * longest if slowest <= rate <= fastest else 0.0

    def _synthesized(
        self, number: int, query: ClipQuery, answer: ClipAnswer | QueryError
    ) -> _SynthesizedClip:
        """Return the clip of a query; raises QueryError for one that cannot be delivered."""
        if isinstance(answer, QueryError):
            raise answer
        delivery = delivery_of(self.work, query.format)
        if delivery is not None:
            roles = self.synthesizer.session.card.roles
            answer = delivery.clip(answer, query.question, roles)
        noted = CLIP_ENCODERS[query.format].noted(answer)
        return _SynthesizedClip(path(number, query.name, query.format), query, noted)

    def _record_fault(self, place: str, message: str) -> None:
        # The table's folder is not part of the job and must not affect its files.
        self.faults.append(RowFault(place.rpartition("/")[2], message))

    def _contents(self, made: list[_SynthesizedClip]) -> list[bytes]:
        """Return the files of the clips; those of one format are encoded together."""
        contents: dict[int, bytes] = {}
        for extension in dict.fromkeys(one.query.format for one in made):
            own = [index for index, one in enumerate(made) if one.query.format == extension]
            files = self._encoded(extension, [made[index].answer for index in own])
            contents |= zip(own, files, strict=True)
        return [contents[index] for index in range(len(made))]

    def _encoded(self, extension: str, answers: Sequence[ClipAnswer]) -> list[bytes]:
        delivery = delivery_of(self.work, extension)
        if delivery is not None:
            return [delivery.encode(answer) for answer in answers]
        job = self.work.job
        convention = CLIP_ENCODERS[extension].convention(job.unit, job.up, job.body)
        return self.layout.encode(extension)(answers, convention)


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
