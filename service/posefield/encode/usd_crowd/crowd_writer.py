"""Writers of crowds as USD, to a file or to a stream."""

import re
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from posefield.common import atomic_files
from posefield.common.errors import FileError, InvalidField
from posefield.common.name_suggestion import did_you_mean
from posefield.encode.character import character
from posefield.encode.files import zip_archive
from posefield.encode.usd_crowd import (
    FILES,
    INSTANCING,
    STREAMS,
    crowd_package,
    crowd_scene,
    crowd_size,
    encoding_process,
)
from posefield.encode.usd_crowd.crowd_size import CrowdCounts
from posefield.encode.usd_layers import layer_metadata
from posefield.motion.crowd_clip import CrowdClip
from posefield.question.body_kind import DEFAULT_BODY, BodyKind

CHILD_PROCESS_SIZE = 32_000_000
"""Bytes of a layer that usd-core writes in about 0.2 s, in which no other thread runs."""


def write(
    crowd: CrowdClip,
    path: Path,
    instancing: str = "references",
    body: BodyKind = DEFAULT_BODY,
) -> None:
    """Write a crowd atomically, in the form of the path's extension.

    .usda and .usdc: one layer. .usd: an entry with a folder `<stem>_clips` beside it, with a layer
    for each motion. .usdz: the same in one archive. With "flatten" it is always one layer. The
    batches are iterated once. Raises InvalidField for an unknown extension or instancing and for a
    crowd too large for a usdz, and FileError if the file cannot be written.
    """
    ending = path.suffix.removeprefix(".")
    _validate(crowd, ending, FILES, instancing)
    if ending == "usdz":
        atomic_files.write_chunks(_usdz(crowd, instancing, body), path)
    elif ending == "usd" and instancing != "flatten":
        _write_folder(crowd, path, instancing == "scenegraph", body)
    else:
        with atomic_files.replacing(path) as made:
            layer_metadata.export_layer(_layer(crowd, _form(ending), instancing, body), made)


def stream(
    crowd: CrowdClip,
    ending: str,
    instancing: str = "references",
    body: BodyKind = DEFAULT_BODY,
) -> Iterator[bytes]:
    """Return an iterator over the bytes of a crowd as usda, usdc or usdz.

    A usdz is sent while its motions are computed; a single layer is first exported to a file on
    disk, which is removed when the stream is closed. Large layers are written by a child process.
    Raises InvalidField at once, as `write` does.
    """
    _validate(crowd, ending, STREAMS, instancing)
    counts = CrowdCounts(
        len(crowd.skeleton),
        len(crowd.motion),
        crowd_scene.motion_count(crowd),
        crowd.frames,
        character.body_size(crowd.skeleton, body),
        len(crowd.curves),
    )
    apart = (
        crowd_size.layer_size_bound(counts, ending, instancing == "flatten") > CHILD_PROCESS_SIZE
    )
    return (encoding_process.stream if apart else encode_here)(crowd, ending, instancing, body)


def encode_here(
    crowd: CrowdClip, ending: str, instancing: str, body: BodyKind = DEFAULT_BODY
) -> Iterator[bytes]:
    """Return the bytes of a crowd as `stream` does, encoded by this process whatever its size."""
    if ending == "usdz":
        return _usdz(crowd, instancing, body)
    return _single_file(crowd, ending, instancing, body)


def _validate(crowd: CrowdClip, ending: str, endings: tuple[str, ...], instancing: str) -> None:
    _check_choice("format", ending, endings)
    _check_choice("instancing", instancing, INSTANCING)
    if ending == "usdz":
        crowd_package.check_size(crowd)


def _check_choice(field: str, found: str, expected: tuple[str, ...]) -> None:
    if found not in expected:
        hint = did_you_mean(found, expected)
        raise InvalidField(field, f"{found!r}{hint}, expected one of {', '.join(expected)}")


def _form(ending: str) -> str:
    return "usda" if ending == "usda" else "usdc"


def _layer(crowd: CrowdClip, form: str, instancing: str, body: BodyKind) -> Any:
    if instancing == "flatten":
        return crowd_package.flat_layer(crowd, form, body)
    return crowd_package.referencing_layer(crowd, form, instancing == "scenegraph", body)


def _single_file(crowd: CrowdClip, ending: str, instancing: str, body: BodyKind) -> Iterator[bytes]:
    with TemporaryDirectory() as name:
        path = Path(name, f"crowd.{ending}")
        layer_metadata.export_layer(_layer(crowd, _form(ending), instancing, body), path)
        yield from atomic_files.read_chunks(path)


def _usdz(crowd: CrowdClip, instancing: str, body: BodyKind) -> Iterator[bytes]:
    if instancing != "flatten":
        members = crowd_package.members(crowd, instancing == "scenegraph", body)
        return zip_archive.zip_chunks(members)
    return _flat_usdz(crowd, body)


def _flat_usdz(crowd: CrowdClip, body: BodyKind) -> Iterator[bytes]:
    with TemporaryDirectory() as name:
        path = Path(name, "crowd.usdc")
        layer_metadata.export_layer(crowd_package.flat_layer(crowd, "usdc", body), path)
        yield from zip_archive.zip_chunks([zip_archive.member_of_file(path.name, path)])


CROWD_LAYER_NAME = re.compile(r"(m\d{5,}|character|summary)\.usdc")


def _write_folder(crowd: CrowdClip, path: Path, instanced: bool, body: BodyKind) -> None:
    """Write a crowd's file and folder atomically, replacing an earlier crowd.

    Raises FileError if the folder contains other files than a crowd's layers, which would be lost.
    """
    folder = path.with_name(f"{path.stem}_clips")
    _check_crowd_folder(folder)
    with atomic_files.replacing_pair(path, folder) as (entry, inside):
        entry.write_bytes(crowd_package.root_layer(crowd, instanced, folder.name))
        for name, content in crowd_package.referenced_layers(crowd, body):
            (inside / name).write_bytes(content)


def _check_crowd_folder(folder: Path) -> None:
    found = [folder] if folder.is_file() else sorted(folder.glob("*"))
    for path in found:
        if not CROWD_LAYER_NAME.fullmatch(path.name):
            raise FileError(path, "in the way; expected nothing here but an earlier crowd's layers")
