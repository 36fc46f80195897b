"""The files of many clips one after the other, as an archive takes them, and the manifest last."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from service.encode import Encoder
from service.encode.convention import Convention
from service.export import manifest
from service.export.query import Query
from service.synthesis import clips
from service.synthesis.question import Prospect
from service.synthesis.synthesizer import Synthesizer

MANIFEST = "manifest.jsonl"
CLIPS, POSES = 16, 4096
"""How many clips are held at once, and how many poses, but for a clip that alone has more."""


@dataclass(frozen=True)
class Order:
    """Clips of one format that have passed the door, and what is known of each."""

    model: Synthesizer
    encoder: Encoder
    convention: Convention
    queries: Sequence[Query]
    prospects: Sequence[Prospect]

    @property
    def warnings(self) -> list[str]:
        """A sentence if some clips are like nothing that was captured, and one if some miss a
        target; the manifest says which."""
        counts = {
            "lie outside what was sampled, or in a gap of it": sum(
                bool(prospect.warnings) for prospect in self.prospects
            ),
            "miss some target": sum(prospect.missed for prospect in self.prospects),
        }
        every = len(self.prospects)
        return [f"{count} of {every} clips {said}" for said, count in counts.items() if count]


def members(order: Order) -> Iterator[tuple[str, bytes]]:
    """Name and content of each clip's file in the order of the queries, then of the manifest.

    A batch is made when its first file is asked for; of those before only lines of the manifest
    are kept.
    """
    # Not a list: what orjson returns has taken a page, whatever its length.
    lines = bytearray()
    for batch in _batches([prospect.frames for prospect in order.prospects]):
        yield from _files(order, order.queries[batch], lines)
    yield MANIFEST, bytes(lines)


def _files(order: Order, queries: Sequence[Query], lines: bytearray) -> Iterator[tuple[str, bytes]]:
    answers = [clips.clip(order.model, query.question) for query in queries]
    contents = order.encoder.write(answers, order.convention)
    for query, answer, content in zip(queries, answers, contents, strict=True):
        file = f"{query.name}.{query.format}"
        lines += manifest.line(manifest.entry(query.name, file, content, answer))
        yield file, content


def _batches(frames: Sequence[int]) -> Iterator[slice]:
    """Clips that are made together, as slices of all."""
    first, poses = 0, 0
    for index, count in enumerate(frames):
        if index > first and (index == first + CLIPS or poses + count > POSES):
            yield slice(first, index)
            first, poses = index, 0
        poses += count
    yield slice(first, len(frames))
