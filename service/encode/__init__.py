"""Tables of formats: encoders of clips, poses, crowds and grids by extension.

The table of archives is `packs.PACKS`.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from service.encode import bvh, crowd_poses, glb, grids, keyframes, poses, tables
from service.encode import convention as conventions
from service.encode.arrow import arrow
from service.encode.convention import CENTIMETRES, METRES, Convention, Unit, Up
from service.encode.crowd import STREAMS
from service.encode.media import ARROW, JSON, MSGPACK, NPZ, Format, by_extension
from service.encode.tables import Table
from service.motion import cancel
from service.motion.answer import ClipAnswer, PoseAnswer, SigmaGrid
from service.motion.crowd import CrowdClip, CrowdPoses

A = TypeVar("A", contravariant=True)


@dataclass(frozen=True)
class Encoder(Format):
    """Encoder of clips in one format; equal results give equal bytes.

    write: returns the files of several results, in their order; those of one model and length are
    computed together. usual: the format's default convention, which its readers expect. law:
    whether the format allows no other convention. at_once: number of frames up to which a file is
    written in a millisecond or two, so that other requests may wait for it. per_joint: largest
    number of bytes of a joint in a frame, without the parts that all frames share.
    """

    write: Callable[[Sequence[ClipAnswer], Convention], list[bytes]]
    per_joint: int
    usual: Convention = METRES
    law: bool = False
    at_once: int = 200

    def convention(self, unit: Unit | None, up: Up | None) -> Convention:
        """Return the requested convention; None is the format's default.

        Raises InvalidField for a convention that the format does not allow.
        """
        found = conventions.of(unit, up, self.usual)
        if self.law:
            conventions.refuse_other(found, self.usual, self.extension)
        return found

    def encode(self, answer: ClipAnswer, convention: Convention | None = None) -> bytes:
        """Return the file of one result, in the format's default convention unless one is given."""
        return self.write([answer], convention or self.usual)[0]


def poses_within(size: int, joints: int, per_joint: int) -> int:
    """Return how many poses fit in `size` bytes; the root position counts as a joint."""
    return size // ((joints + 1) * per_joint)


def one_by_one(
    encode: Callable[[ClipAnswer, Convention], bytes],
) -> Callable[[Sequence[ClipAnswer], Convention], list[bytes]]:
    """Return a function that encodes several results one after the other."""

    def write(answers: Sequence[ClipAnswer], convention: Convention) -> list[bytes]:
        files = []
        for answer in answers:
            cancel.check()
            files.append(encode(answer, convention))
        return files

    return write


def numbers(
    write: Callable[[Table], bytes],
) -> Callable[[Sequence[ClipAnswer], Convention], list[bytes]]:
    """Return a function that encodes several results as tables."""
    return one_by_one(lambda answer, convention: write(keyframes.table(answer, convention)))


def _usd(name: str) -> Callable[[Sequence[ClipAnswer], Convention], list[bytes]]:
    """Return the USD writer of that name, which imports usd-core when it is first called.

    The import takes 0.12 CPU seconds, a seventh of the service's start.
    """

    def write(answers: Sequence[ClipAnswer], convention: Convention) -> list[bytes]:
        from service.encode import usd

        writers = {"usda": usd.usda, "usdc": usd.usdc, "usdz": usd.usdz}
        return writers[name](answers, convention)

    return write


ENCODERS = by_extension(
    # A template takes 30 ms to make, and each number of frames needs another one.
    Encoder("usda", "model/vnd.usda", _usd("usda"), 120, at_once=0),
    # Unlike those of usda and usdz, not registered with IANA, but in common use.
    Encoder("usdc", "model/vnd.usdc", _usd("usdc"), 48, at_once=0),
    Encoder("usdz", "model/vnd.usdz+zip", _usd("usdz"), 48, at_once=0),
    Encoder("json", JSON, one_by_one(keyframes.json), 96),
    Encoder("bvh", "application/x-bvh", one_by_one(bvh.bvh), 72, CENTIMETRES),
    Encoder("glb", "model/gltf-binary", one_by_one(glb.glb), 24, law=True),
    Encoder("npz", NPZ, numbers(tables.npz), 24),
    Encoder("arrow", ARROW, numbers(arrow), 24),
    Encoder("msgpack", MSGPACK, numbers(tables.msgpack), 24),
)


@dataclass(frozen=True)
class TableEncoder(Format, Generic[A]):
    """Encoder of poses, crowd poses or grids as tables in one format.

    table: returns the table of a result. write: returns its bytes. at_once: number of poses or grid
    points up to which a result is computed and written in about a millisecond, so that other
    requests may wait for it. per_joint: largest number of bytes of a joint of a character. most:
    largest number of characters.
    """

    table: Callable[[A], Table]
    write: Callable[[Table], bytes]
    at_once: int = 0
    per_joint: int = 40
    most: float = math.inf

    def encode(self, answer: A) -> bytes:
        """Return the bytes of a result."""
        return self.write(self.table(answer))


POSE_ENCODERS: dict[str, TableEncoder[PoseAnswer[Any]]] = by_extension(
    TableEncoder("json", JSON, poses.table, tables.json, at_once=200),
    TableEncoder("msgpack", MSGPACK, poses.table, tables.msgpack, at_once=2000),
    TableEncoder("npz", NPZ, poses.table, tables.npz, at_once=2000),
    TableEncoder("arrow", ARROW, poses.table, arrow, at_once=2000),
)

CROWD_ENCODERS: dict[str, TableEncoder[CrowdPoses]] = by_extension(
    TableEncoder("arrow", ARROW, crowd_poses.table, arrow),
    TableEncoder("npz", NPZ, crowd_poses.table, tables.npz),
    TableEncoder("msgpack", MSGPACK, crowd_poses.table, tables.msgpack),
    TableEncoder(
        "json", JSON, crowd_poses.table, tables.json, per_joint=150, most=crowd_poses.JSON_LIMIT
    ),
)

GRID_ENCODERS: dict[str, TableEncoder[SigmaGrid]] = by_extension(
    TableEncoder("json", JSON, grids.table, tables.json, at_once=1024),
    TableEncoder("msgpack", MSGPACK, grids.table, tables.msgpack, at_once=1024),
    TableEncoder("npz", NPZ, grids.table, tables.npz, at_once=1024),
    # A stream of rows, one for each point of the grid.
    TableEncoder("arrow", ARROW, grids.points, arrow, at_once=1024),
)


@dataclass(frozen=True)
class CrowdWriter(Format):
    """Writer of walking crowds as streams of USD in one format."""

    def stream(self, crowd: CrowdClip, instancing: str) -> Iterator[bytes]:
        """Return an iterator over the bytes of a crowd.

        Raises InvalidField as `crowd.writer.stream` does.
        """
        from service.encode.crowd import writer  # usd-core: 0.12 CPU seconds of the start

        return writer.stream(crowd, self.extension, instancing)


CROWD_WRITERS = by_extension(*(CrowdWriter(name, ENCODERS[name].media_type) for name in STREAMS))
