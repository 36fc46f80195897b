"""Crowds as USD, to a file or to a stream.

How characters share what they have in common is up to who reads them:

references  every character refers to one prototype; the only sharing that Blender's default
            import, and pxr, both move.
scenegraph  the same, instanceable: least to draw and to open. Blender's default import shows it
            as one character frozen in its rest pose.
flatten     nothing is shared and all is in one layer, which readers without composition need.
"""

from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from service.encode import layers, usdz
from service.encode.crowd import folder, package, single
from service.motion import files
from service.motion.crowd import CrowdClip
from service.motion.errors import InvalidField

INSTANCING = ("references", "scenegraph", "flatten")
FILES, STREAMS = ("usd", "usda", "usdc", "usdz"), ("usda", "usdc", "usdz")
"""Endings of what is written to disk, and of what needs no folder beside it."""


def write(crowd: CrowdClip, path: Path, instancing: str = "references") -> None:
    """Write a crowd by the ending of the path, whole or not at all.

    .usda and .usdc: one layer. .usd: an entry with a folder `<stem>_clips` beside it, which has a
    layer for each motion. .usdz: the same in one archive. What is flattened is always one layer.
    The batches are gone through once. Raises InvalidField where ending or instancing are unknown
    or a usdz would not hold the crowd, and FileError where the file cannot be written.
    """
    ending = path.suffix.removeprefix(".")
    _door(crowd, ending, FILES, instancing)
    if ending == "usdz":
        files.stream(_usdz(crowd, instancing), path)
    elif ending == "usd" and instancing != "flatten":
        folder.write(crowd, path, instancing == "scenegraph")
    else:
        with files.replacing(path) as made:
            layers.export(_layer(crowd, instancing), made)


def stream(crowd: CrowdClip, ending: str, instancing: str = "references") -> Iterator[bytes]:
    """The bytes of a crowd as usda, usdc or usdz, piece by piece.

    A usdz is sent while its motions are made; a single layer is first exported to a file on disk,
    which goes when the stream is closed. Raises InvalidField at once, as `write` does.
    """
    _door(crowd, ending, STREAMS, instancing)
    return _usdz(crowd, instancing) if ending == "usdz" else _single(crowd, ending, instancing)


def _door(crowd: CrowdClip, ending: str, endings: tuple[str, ...], instancing: str) -> None:
    _known("format", ending, endings)
    _known("instancing", instancing, INSTANCING)
    if ending == "usdz":
        package.fits(crowd)


def _known(field: str, found: str, expected: tuple[str, ...]) -> None:
    if found not in expected:
        raise InvalidField(field, f"{found!r}, expected one of {', '.join(expected)}")


def _layer(crowd: CrowdClip, instancing: str) -> Any:
    if instancing == "flatten":
        return single.flat(crowd)
    return single.referring(crowd, instancing == "scenegraph")


def _single(crowd: CrowdClip, ending: str, instancing: str) -> Iterator[bytes]:
    with TemporaryDirectory() as name:
        path = Path(name, f"crowd.{ending}")
        layers.export(_layer(crowd, instancing), path)
        yield from files.pieces(path)


def _usdz(crowd: CrowdClip, instancing: str) -> Iterator[bytes]:
    if instancing != "flatten":
        return usdz.archive(package.members(crowd, instancing == "scenegraph"))
    return _flat_usdz(crowd)


def _flat_usdz(crowd: CrowdClip) -> Iterator[bytes]:
    with TemporaryDirectory() as name:
        path = Path(name, "crowd.usdc")
        layers.export(single.flat(crowd), path)
        yield from usdz.archive([usdz.lying(path.name, path)])
