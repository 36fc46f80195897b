"""How the files of many clips are laid out: as they are in folders, or packed into archives.

An archive holds the files under the paths that they have in folders: unpacked, all archives of an
export give what the folders would have been. A library is a stage of one character beside layers of
nothing but motion.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from service.encode import ENCODERS, animation
from service.encode.convention import Convention
from service.encode.packs import PACKS, Pack
from service.export import library, manifest
from service.export.job import Job, Work
from service.export.query import Query
from service.export.target import Target
from service.motion.answer import ClipAnswer
from service.motion.errors import InvalidField

CROWDED = 1000
"""Files in a folder; many more make file systems and file browsers slow."""

Entry = dict[str, Any]


@dataclass(frozen=True)
class File:
    """A clip's file: its path, its content and its entry in the manifest."""

    path: str
    content: bytes
    entry: Entry


Put = Callable[[Target, int, Iterable[list[File]]], tuple[list[Entry], int]]
"""Puts the files of the chunk of a number, which come in batches: their entries, and the bytes
written."""


Write = Callable[[Sequence[ClipAnswer], Convention], list[bytes]]


@dataclass(frozen=True)
class Layout:
    """Where files lie, and what is in them.

    chunk: rows that are usually done together. encode: what writes files of a format. misfit: why
    a query has no place here; none where all have. describe: what else an entry says of a clip of
    some name and path. complete: files about the whole export, from all its entries.
    """

    chunk: int
    put: Put
    encode: Callable[[str], Write] = lambda extension: ENCODERS[extension].write
    misfit: Callable[[Job, Query], str | None] | None = None
    describe: Callable[[str, str, ClipAnswer], Entry] = lambda name, path, answer: {}
    complete: Callable[[Work, Iterable[Entry]], Iterable[tuple[str, bytes]]] = (
        lambda work, entries: ()
    )


def path(row: int, name: str, extension: str) -> str:
    """Where the file of a row lies, or would if it were not packed."""
    return f"clips/{row // CROWDED:03d}/{name}.{extension}"


def loose(target: Target, number: int, batches: Iterable[list[File]]) -> tuple[list[Entry], int]:
    """Files as they are."""
    entries = []
    for files in batches:
        target.write([(file.path, file.content) for file in files])
        entries += [file.entry for file in files]
    return entries, sum(entry["bytes"] for entry in entries)


def packed(pack: Pack) -> Put:
    """Files in one archive a chunk, whose part of the manifest is its last member."""

    def put(target: Target, number: int, batches: Iterable[list[File]]) -> tuple[list[Entry], int]:
        entries: list[Entry] = []
        archive = f"clips-{number:06d}.{pack.extension}"
        size = target.stream(archive, pack.write(_members(number, batches, entries)))
        return [{**entry, "archive": archive} for entry in entries], size

    return put


def _members(
    number: int, batches: Iterable[list[File]], entries: list[Entry]
) -> Iterator[tuple[str, bytes]]:
    """Files by path, then their entries, which are added to `entries` on the way."""
    for files in batches:
        for file in files:
            entries.append(file.entry)
            yield file.path, file.content
    yield f"manifest-{number:06d}.jsonl", b"".join(map(manifest.line, entries))


LAYOUTS = {
    "folder": Layout(256, loose),
    "library": Layout(
        256,
        loose,
        lambda extension: animation.usdc,
        library.misfit,
        library.describe,
        library.complete,
    ),
    **{pack.extension: Layout(1000, packed(pack)) for pack in PACKS.values()},
}


def find(name: str) -> Layout:
    """Layout of a name; InvalidField where there is none."""
    if name not in LAYOUTS:
        raise InvalidField("layout", f"{name!r}, expected one of {', '.join(LAYOUTS)}")
    return LAYOUTS[name]
