"""A chunk of an export: some rows of the queries, made into files by whoever it is given to.

`make(work, task)` is all of it: a pure function of the job and the rows, so a chunk may be done
anywhere, again, or twice at once, and its files are the same. Its last act is to leave its part of
the manifest with the others.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from service.encode import ENCODERS
from service.export import layouts, ledger, manifest
from service.export.job import Job, Work, opened
from service.export.layouts import Entry, File, Layout, path
from service.export.ledger import Part
from service.export.query import KEPT, Fault, Query
from service.export.target import open_target
from service.motion.answer import ClipAnswer
from service.motion.errors import InvalidField, QueryError
from service.synthesis import clips
from service.synthesis.synthesizer import Synthesizer

CLIPS, POSES = 128, 8192
"""Clips and poses that are held at once, but for a clip that alone has more: enough to share what
their files have in common."""

Stopped = Callable[[], bool]
"""Whether everything should stop; what was begun is put away."""


class Stop(Exception):
    """A chunk that was given up because everything should stop."""


@dataclass(frozen=True)
class Task:
    """The chunk of a number, from row `first` on; its rows in their order."""

    number: int
    first: int
    rows: tuple[Query | Fault, ...]


def make(work: Work, task: Task, stopped: Stopped = lambda: False) -> Part:
    """Do a chunk; what it came to.

    Raises InvalidField that names rows at fault where they are not skipped, FileError where the
    target cannot be written, Stop where it should stop; none of these leaves a part.
    """
    target = open_target(work.target)
    layout = layouts.find(work.job.layout)
    chunk = _Chunk(work.job, layout, opened(work), task, [])
    entries, size = layout.put(target, task.number, chunk.batches(stopped))
    if chunk.faults and not work.skip:
        raise refusal(len(chunk.faults), chunk.faults)
    warned = sum(bool(entry["warnings"]) for entry in entries)
    part = Part(len(entries), size, warned, chunk.faults)
    ledger.record(target, task.number, part, entries)
    return part


def refusal(count: int, faults: Sequence[Fault]) -> InvalidField:
    """What to say of rows that are no queries; of a count of them, the first are at hand."""
    said = "".join(f"\n  {fault.place}: {fault.message}" for fault in faults[:KEPT])
    more = f"\n  and {count - KEPT} more" if count > KEPT else ""
    found = f"rows that cannot be answered: {count} (--skip-errors leaves them out)"
    return InvalidField("queries", f"{found}:{said}{more}")


@dataclass(frozen=True)
class _Made:
    path: str
    query: Query
    answer: ClipAnswer


@dataclass(frozen=True)
class _Chunk:
    """A chunk while it is made. faults: those found so far."""

    job: Job
    layout: Layout
    synthesizer: Synthesizer
    task: Task
    faults: list[Fault]

    def batches(self, stopped: Stopped) -> Iterator[list[File]]:
        """Files of the rows that can be answered, in order."""
        made: list[_Made] = []
        poses = 0
        for one in self._made():
            made.append(one)
            poses += len(one.answer.clip)
            if len(made) == CLIPS or poses >= POSES:
                yield self._files(made)
                made, poses = [], 0
                if stopped():
                    raise Stop
        yield self._files(made)

    def _files(self, made: list[_Made]) -> list[File]:
        contents = self._contents(made)
        return [
            File(one.path, content, self._entry(one, content))
            for one, content in zip(made, contents, strict=True)
        ]

    def _entry(self, one: _Made, content: bytes) -> Entry:
        said = manifest.entry(one.query.name, one.path, content, one.answer)
        return said | self.layout.describe(one.query.name, one.path, one.answer)

    def _made(self) -> Iterator[_Made]:
        for number, row in enumerate(self.task.rows, self.task.first):
            if isinstance(row, Fault):
                self._note(row.place, row.message)
                continue
            try:
                answer = clips.clip(self.synthesizer, row.question)
            except QueryError as fault:
                self._note(row.place, str(fault))
            else:
                yield _Made(path(number, row.name, row.format), row, answer)

    def _note(self, place: str, message: str) -> None:
        # In which folder a table lies is no part of the job, so that it must not show in its files.
        self.faults.append(Fault(place.rpartition("/")[2], message))

    def _contents(self, made: list[_Made]) -> list[bytes]:
        """Files of the clips, those of a format made together."""
        contents: dict[int, bytes] = {}
        for extension in dict.fromkeys(one.query.format for one in made):
            own = [index for index, one in enumerate(made) if one.query.format == extension]
            convention = ENCODERS[extension].convention(self.job.unit, self.job.up)
            answers = [made[index].answer for index in own]
            files = self.layout.encode(extension)(answers, convention)
            contents |= zip(own, files, strict=True)
        return [contents[index] for index in range(len(made))]
