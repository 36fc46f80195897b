"""Bytes of an answer in each format that the service writes."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from service.encode import bvh, crowd_poses, glb, keyframes, poses, tables, usd, usdz
from service.encode import convention as conventions
from service.encode.arrow import arrow
from service.encode.convention import CENTIMETRES, METRES, Convention, Unit, Up
from service.encode.media import ARROW, JSON, MSGPACK, NPZ
from service.encode.tables import Table
from service.motion.answer import ClipAnswer, PoseAnswer
from service.motion.crowd import CrowdPoses


@dataclass(frozen=True)
class Encoder:
    """How one format is named and made; the same answer always gives the same bytes.

    write: files of several answers, as long as they and in their order; those of one model and
    length are made together. usual: the convention that readers of the format expect; law: whether
    it allows no other. at_once: frames up to which a file is written in so little time (a
    millisecond or two) that others may wait for it. per_joint: bytes that a joint takes in a frame
    at most; beside them stands what all frames share.
    """

    extension: str
    media_type: str
    write: Callable[[Sequence[ClipAnswer], Convention], list[bytes]]
    per_joint: int
    usual: Convention = METRES
    law: bool = False
    at_once: int = 200

    def convention(self, unit: Unit | None, up: Up | None) -> Convention:
        """What is asked for, and as usual where nothing is; InvalidField where the format's law is
        another."""
        found = conventions.of(unit, up, self.usual)
        if self.law:
            conventions.refuse_other(found, self.usual, self.extension)
        return found

    def encode(self, answer: ClipAnswer, convention: Convention | None = None) -> bytes:
        """File of one answer, in the usual convention if none is said."""
        return self.write([answer], convention or self.usual)[0]


def poses_within(size: int, joints: int, per_joint: int) -> int:
    """How many poses so many bytes hold, whatever they are; the root's place counts as a joint."""
    return size // ((joints + 1) * per_joint)


def one_by_one(
    encode: Callable[[ClipAnswer, Convention], bytes],
) -> Callable[[Sequence[ClipAnswer], Convention], list[bytes]]:
    """What writes several answers where they have nothing in common."""
    return lambda answers, convention: [encode(answer, convention) for answer in answers]


def numbers(
    write: Callable[[Table], bytes],
) -> Callable[[Sequence[ClipAnswer], Convention], list[bytes]]:
    """What writes several answers as tables."""
    return one_by_one(lambda answer, convention: write(keyframes.table(answer, convention)))


ENCODERS = {
    encoder.extension: encoder
    for encoder in (
        # A template takes 30 ms to make, and every number of frames has one of its own.
        Encoder("usda", "model/vnd.usda", usd.usda, 120, at_once=0),
        # Not registered, unlike those of text and package, but what others call it.
        Encoder("usdc", "model/vnd.usdc", usd.usdc, 48, at_once=0),
        Encoder("usdz", "model/vnd.usdz+zip", usdz.usdz, 48, at_once=0),
        Encoder("json", JSON, one_by_one(keyframes.json), 96),
        Encoder("bvh", "application/x-bvh", one_by_one(bvh.bvh), 72, CENTIMETRES),
        Encoder("glb", "model/gltf-binary", one_by_one(glb.glb), 24, law=True),
        Encoder("npz", NPZ, numbers(tables.npz), 24),
        Encoder("arrow", ARROW, numbers(arrow), 24),
        Encoder("msgpack", MSGPACK, numbers(tables.msgpack), 24),
    )
}


@dataclass(frozen=True)
class PoseEncoder:
    """How one format of poses at some times is named and made.

    at_once: poses up to which it is asked for and written in so little time (a millisecond) that
    others may wait for it; of the binary ones that is mostly the graph's.
    """

    extension: str
    media_type: str
    write: Callable[[Table], bytes]
    at_once: int = 2000

    def encode(self, answer: PoseAnswer[Any]) -> bytes:
        """Bytes of an answer."""
        return self.write(poses.table(answer))


POSE_ENCODERS = {
    encoder.extension: encoder
    for encoder in (
        PoseEncoder("json", JSON, tables.json, at_once=200),
        PoseEncoder("msgpack", MSGPACK, tables.msgpack),
        PoseEncoder("npz", NPZ, tables.npz),
        PoseEncoder("arrow", ARROW, arrow),
    )
}


@dataclass(frozen=True)
class CrowdEncoder:
    """How one format of crowd poses is named and made, the bytes that a joint of a character takes
    at most, and the most characters it is good for."""

    extension: str
    media_type: str
    write: Callable[[Table], bytes]
    per_joint: int
    most: float = math.inf

    def encode(self, crowd: CrowdPoses) -> bytes:
        """Bytes of a block of poses."""
        return self.write(crowd_poses.table(crowd))


CROWD_ENCODERS = {
    encoder.extension: encoder
    for encoder in (
        CrowdEncoder("arrow", ARROW, arrow, 40),
        CrowdEncoder("npz", NPZ, tables.npz, 40),
        CrowdEncoder("msgpack", MSGPACK, tables.msgpack, 40),
        CrowdEncoder("json", JSON, tables.json, 150, crowd_poses.JSON_LIMIT),
    )
}
