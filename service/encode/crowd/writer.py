"""Writers of crowds as USD, to a file or to a stream."""

from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from service.encode import layers, zip_archive
from service.encode.crowd import (
    FILES,
    INSTANCING,
    STREAMS,
    crowd_size,
    encoding_process,
    folder,
    motions,
    package,
    single,
)
from service.encode.crowd.crowd_size import Counts
from service.motion import files
from service.motion.crowd import CrowdClip
from service.motion.errors import InvalidField

APART = 32_000_000
"""Bytes of a layer that usd-core writes in about 0.2 s, in which no other thread runs."""


def write(crowd: CrowdClip, path: Path, instancing: str = "references") -> None:
    """Write a crowd atomically, in the form of the path's extension.

    .usda and .usdc: one layer. .usd: an entry with a folder `<stem>_clips` beside it, with a layer
    for each motion. .usdz: the same in one archive. With "flatten" it is always one layer. The
    batches are iterated once. Raises InvalidField for an unknown extension or instancing and for a
    crowd too large for a usdz, and FileError if the file cannot be written.
    """
    ending = path.suffix.removeprefix(".")
    _door(crowd, ending, FILES, instancing)
    if ending == "usdz":
        files.stream(_usdz(crowd, instancing), path)
    elif ending == "usd" and instancing != "flatten":
        folder.write(crowd, path, instancing == "scenegraph")
    else:
        with files.replacing(path) as made:
            layers.export(_layer(crowd, _form(ending), instancing), made)


def stream(crowd: CrowdClip, ending: str, instancing: str = "references") -> Iterator[bytes]:
    """Return an iterator over the bytes of a crowd as usda, usdc or usdz.

    A usdz is sent while its motions are computed; a single layer is first exported to a file on
    disk, which is removed when the stream is closed. Large layers are written by a child process.
    Raises InvalidField at once, as `write` does.
    """
    _door(crowd, ending, STREAMS, instancing)
    counts = Counts(len(crowd.skeleton), len(crowd.motion), motions.count(crowd), crowd.frames)
    apart = crowd_size.layer(counts, ending, instancing == "flatten") > APART
    return (encoding_process.stream if apart else encoded)(crowd, ending, instancing)


def encoded(crowd: CrowdClip, ending: str, instancing: str) -> Iterator[bytes]:
    """Return the bytes of a crowd as `stream` does, encoded by this process whatever its size."""
    return _usdz(crowd, instancing) if ending == "usdz" else _single(crowd, ending, instancing)


def _door(crowd: CrowdClip, ending: str, endings: tuple[str, ...], instancing: str) -> None:
    _known("format", ending, endings)
    _known("instancing", instancing, INSTANCING)
    if ending == "usdz":
        package.fits(crowd)


def _known(field: str, found: str, expected: tuple[str, ...]) -> None:
    if found not in expected:
        raise InvalidField(field, f"{found!r}, expected one of {', '.join(expected)}")


def _form(ending: str) -> str:
    return "usda" if ending == "usda" else "usdc"


def _layer(crowd: CrowdClip, form: str, instancing: str) -> Any:
    if instancing == "flatten":
        return single.flat(crowd, form)
    return single.referring(crowd, form, instancing == "scenegraph")


def _single(crowd: CrowdClip, ending: str, instancing: str) -> Iterator[bytes]:
    with TemporaryDirectory() as name:
        path = Path(name, f"crowd.{ending}")
        layers.export(_layer(crowd, _form(ending), instancing), path)
        yield from files.pieces(path)


def _usdz(crowd: CrowdClip, instancing: str) -> Iterator[bytes]:
    if instancing != "flatten":
        return zip_archive.archive(package.members(crowd, instancing == "scenegraph"))
    return _flat_usdz(crowd)


def _flat_usdz(crowd: CrowdClip) -> Iterator[bytes]:
    with TemporaryDirectory() as name:
        path = Path(name, "crowd.usdc")
        layers.export(single.flat(crowd, "usdc"), path)
        yield from zip_archive.archive([zip_archive.lying(path.name, path)])
