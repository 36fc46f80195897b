"""Files of many clips in sequence, as an archive takes them, with the manifest last."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from posefield.batch.job import manifest_entry, manifest_line
from posefield.batch.rows import ClipQuery
from posefield.characters.delivery import Delivery
from posefield.common import cancellation
from posefield.common.errors import QueryError
from posefield.encode.conventions import Convention
from posefield.encode.formats import ClipEncoder, left_out
from posefield.question.results import ClipAnswer
from posefield.synthesis import clips
from posefield.synthesis.clips import ClipPreview
from posefield.synthesis.synthesizer import Synthesizer

MANIFEST = "manifest.jsonl"
CLIPS, POSES = 16, 4096
"""Largest number of clips and poses in memory, except for a single longer clip."""


@dataclass(frozen=True)
class ArchiveOrder:
    """Validated clips of one format.

    queries: of the clips. prospects: frames and warnings of each, known before synthesis. delivery:
    to a character of a user; None for that of the model.
    """

    model: Synthesizer
    encoder: ClipEncoder
    convention: Convention
    queries: Sequence[ClipQuery]
    prospects: Sequence[ClipPreview]
    delivery: Delivery | None = None

    @property
    def warnings(self) -> list[str]:
        """Warnings with the number of clips that extrapolate and of clips that miss a target.

        The manifest has the warnings of each clip.
        """
        counts = {
            "lie outside what was sampled, or in a gap of it": sum(
                bool(prospect.warnings) for prospect in self.prospects
            ),
            "miss some target": sum(prospect.missed for prospect in self.prospects),
        }
        every = len(self.prospects)
        found = [f"{count} of {every} clips {said}" for said, count in counts.items() if count]
        curves = [curve.name for curve in self.model.session.card.curves]
        if curves and not self.encoder.has_curves:
            found.append(left_out(curves, self.encoder.extension))
        return found


def archive_members(order: ArchiveOrder) -> Iterator[tuple[str, bytes]]:
    """Yield name and content of each clip's file in the order of the queries, then the manifest.

    A batch is made when its first file is requested; of earlier batches only manifest lines remain
    in memory.
    """
    # Not a list: each bytes object of orjson occupies a page of memory, whatever its length.
    lines = bytearray()
    for batch in _batches([prospect.frames for prospect in order.prospects]):
        yield from _files(order, order.queries[batch], lines)
    yield MANIFEST, bytes(lines)


def _files(
    order: ArchiveOrder, queries: Sequence[ClipQuery], lines: bytearray
) -> Iterator[tuple[str, bytes]]:
    questions = [query.question for query in queries]
    found = clips.synthesize_clips(order.model, questions)
    answers = [order.encoder.noted(_clip(order, *own)) for own in zip(queries, found, strict=True)]
    if order.delivery is None:
        contents = order.encoder.write(answers, order.convention)
    else:
        contents = [order.delivery.encode(answer) for answer in answers]
    for query, answer, content in zip(queries, answers, contents, strict=True):
        file = f"{query.name}.{query.format}"
        lines += manifest_line(manifest_entry(query.name, file, content, answer))
        yield file, content


def _clip(order: ArchiveOrder, query: ClipQuery, answer: ClipAnswer | QueryError) -> ClipAnswer:
    """Return the clip of a query, delivered; raises QueryError for one that cannot be."""
    cancellation.check()
    if isinstance(answer, QueryError):
        raise answer
    if order.delivery is None:
        return answer
    return order.delivery.clip(answer, query.question, order.model.session.card.roles)


def _batches(frames: Sequence[int]) -> Iterator[slice]:
    """Yield slices of clips that are made together."""
    first, poses = 0, 0
    for index, count in enumerate(frames):
        if index > first and (index == first + CLIPS or poses + count > POSES):
            yield slice(first, index)
            first, poses = index, 0
        poses += count
    yield slice(first, len(frames))
