"""Traces of pedestrians in ASAM's Open Simulation Interface 3.8, with the bones of each person.

A trace is a sequence of messages `GroundTruth`, one for each frame, each after its length. The
messages hold thousands of equal parts, of which only the numbers differ, so a part is laid out once
as bytes with gaps for the numbers, and NumPy fills the gaps of all frames of a person at once.

All parts have a fixed size. So the place of each person in each message is known before any motion
is computed: people are written to their places one after the other, and no message is ever in
memory.

World: x east, y north, z up, as in files of tracks, so (x, y, z) is (X, -Z, Y). People: x ahead, y
to the left, z up. A bone is where its parent in OSI's hierarchy sees it, turned from the rest pose
of the model, in the axes of people; its rate of orientation is the angular velocity about the
parent's axes. The root is on the floor below the hips, at the foot of the box.
"""

import os
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import islice
from pathlib import Path
from typing import Annotated

import numpy as np
import numpy.typing as npt

from posefield.common import cancellation
from posefield.common.errors import InvalidField
from posefield.common.units import UP, Floats, Frames, Indices
from posefield.encode import bone_motion
from posefield.encode.bone_motion import BoneMotion
from posefield.motion import quat, skeleton
from posefield.motion.clip import CrowdClip
from posefield.motion.skeleton import Skeleton

ROOT = ("root", 0)
BONES = (
    ("hips", 1, "root"),
    ("spine", 2, "hips"),
    ("upperChest", 3, "spine"),
    ("neck", 4, "upperChest"),
    ("head", 5, "neck"),
    ("leftShoulder", 6, "upperChest"),
    ("rightShoulder", 7, "upperChest"),
    ("leftUpperArm", 8, "leftShoulder"),
    ("rightUpperArm", 9, "rightShoulder"),
    ("leftLowerArm", 10, "leftUpperArm"),
    ("rightLowerArm", 11, "rightUpperArm"),
    ("leftHand", 12, "leftLowerArm"),
    ("rightHand", 13, "rightLowerArm"),
    ("leftUpperLeg", 14, "hips"),
    ("rightUpperLeg", 15, "hips"),
    ("leftLowerLeg", 16, "leftUpperLeg"),
    ("rightLowerLeg", 17, "rightUpperLeg"),
    ("leftFoot", 18, "leftLowerLeg"),
    ("rightFoot", 19, "rightLowerLeg"),
)
"""Role, OSI's type, and role of the parent of each bone; a chest stands in for an upper chest."""
VERSION, PEDESTRIAN, IDENTIFIER_TYPE = (3, 8, 0), 3, "track"
BASE = 21
"""Numbers of a person before those of its bones: seven vectors."""
MARGIN = 0.1
"""Distance, m, from the joints to the sides of the box: of the skin."""
TOGETHER = 16
"""People whose parts are written together: 4.5 MB each for a minute at 30 frames a second."""


@dataclass(frozen=True)
class Layout:
    """Bytes of a message, with gaps of 8 bytes for numbers at the offsets `gaps`."""

    data: bytes
    gaps: tuple[int, ...] = ()

    def __add__(self, other: "Layout") -> "Layout":
        shifted = tuple(len(self.data) + gap for gap in other.gaps)
        return Layout(self.data + other.data, self.gaps + shifted)


def varint(number: int) -> bytes:
    """Return a whole number in the wire format; negative ones as 64 bits."""
    number &= (1 << 64) - 1
    groups = []
    while number > 0x7F:
        groups.append(number & 0x7F | 0x80)
        number >>= 7
    return bytes([*groups, number])


def whole(field: int, number: int) -> Layout:
    """Return a field with a whole number."""
    return Layout(varint(field << 3) + varint(number))


def message(field: int, *parts: Layout) -> Layout:
    """Return a field with a message of parts."""
    content = sum(parts, Layout(b""))
    return Layout(varint(field << 3 | 2) + varint(len(content.data))) + content


def numbers(field: int) -> Layout:
    """Return a field with a message of three numbers: a vector, an orientation or a dimension."""
    return message(field, *(Layout(varint(n << 3 | 1) + bytes(8), (1,)) for n in (1, 2, 3)))


@cache
def _base_and_skeleton() -> tuple[Layout, Layout]:
    """Return the parts of a person that are equal for all but for their numbers."""
    bones = [
        message(2, whole(1, kind), numbers(2), numbers(3), numbers(6), numbers(7))
        for kind in (ROOT[1], *(kind for _, kind, _ in BONES))
    ]
    return message(2, *(numbers(field) for field in range(1, 7))), message(12, numbers(1), *bones)


def moving_object(index: int, person: str) -> Layout:
    """Return the field of one person in a `GroundTruth`, with gaps for its numbers."""
    base, bones = _base_and_skeleton()
    identity = message(1, whole(1, index))
    source = message(
        10, message(2, Layout(IDENTIFIER_TYPE.encode())), message(3, Layout(person.encode()))
    )
    return message(5, identity, base, whole(3, PEDESTRIAN), source, bones)


def frame_head(time: float, size: int) -> bytes:
    """Return the length and the head of the message at a time, s. size: of its people, bytes."""
    nanoseconds = round(time * 1e9)
    version = [whole(field, number) for field, number in enumerate(VERSION, 1)]
    stamp = whole(1, nanoseconds // 10**9), whole(2, nanoseconds % 10**9)
    head = (message(1, *version) + message(2, *stamp)).data
    return struct.pack("<I", len(head) + size) + head


def bone_paths(joints: Skeleton, roles: Mapping[str, str]) -> list[tuple[int, ...]]:
    """Return of each bone the joints from below its parent on, to its own.

    Raises InvalidField for a skeleton that lacks a bone, or has another hierarchy.
    """
    names = dict(roles)
    names.setdefault("upperChest", names.get("chest", ""))
    missing = [role for role, _, _ in BONES if names.get(role, "") not in joints.names]
    if missing:
        raise InvalidField("format", f"osi, but the model has no joint for {', '.join(missing)}")
    indices = {role: joints.names.index(names[role]) for role, _, _ in BONES}
    paths = []
    for role, _, parent in BONES:
        chain = skeleton.joint_chain(joints.parents, indices[role])
        if parent != ROOT[0]:
            if indices[parent] not in chain:
                raise InvalidField("format", f"osi, but {role} is not below {parent} in the model")
            chain = chain[chain.index(indices[parent]) + 1 :]
        paths.append(chain)
    return paths


def _write_bones(
    motion: BoneMotion,
    paths: Sequence[tuple[int, ...]],
    headings: Frames,
    gaps: Annotated[Floats, "frames paths 4 3"],
) -> None:
    """Write the numbers of the bones of one person to their gaps.

    One bone after the other, because its arrays stay in the cache of a processor.
    """
    rotations, arms = np.ascontiguousarray(motion.rotations.transpose(1, 2, 0)), motion.offsets
    back = np.ascontiguousarray(quat.from_axis_angle(UP, -headings).T)
    for bone, path in enumerate(paths):
        turn, offset = rotations[path[0]].copy(), np.empty((3, len(motion)))
        offset[:] = arms[path[0]][:, None]
        if path[0] == 0:
            quat.product_planes(back, rotations[0], turn)
            offset[:] = (motion.roots * UP).T
        for joint in path[1:]:
            step = np.empty_like(offset)
            quat.rotate_planes(turn, arms[joint][:, None], step)
            offset += step
            quat.product_planes(turn.copy(), rotations[joint], turn)
        # Ahead, left and up are Z, X and Y of the model.
        turns, places = turn[[0, 3, 1, 2]].T, offset[[2, 0, 1]].T
        gaps[:, bone, 0], gaps[:, bone, 1] = places, euler_angles(turns)
        gaps[:, bone, 2] = bone_motion.differences(places, motion.rate)
        gaps[:, bone, 3] = bone_motion.angular_velocities(turns, motion.rate)


def _base_numbers(motion: BoneMotion, headings: Frames) -> Annotated[Floats, "7 frames 3"]:
    """Return the seven vectors of the box of one person, in the order of their gaps."""
    box, values = _box(motion), np.zeros((BASE // 3, len(motion), 3))
    dimension, centre, orientation, velocity, acceleration, rate, root = values
    dimension[:], root[:] = box, box * [0.0, 0.0, -0.5]
    centre[:, 0], centre[:, 1] = motion.roots[:, 0], -motion.roots[:, 2]
    centre[:, 2] = 0.5 * box[2]
    yaws = headings - 0.5 * np.pi
    orientation[:, 2] = np.arctan2(np.sin(yaws), np.cos(yaws))
    velocity[:] = bone_motion.differences(centre, motion.rate)
    acceleration[:] = bone_motion.differences(velocity, motion.rate)
    rate[:, 2] = bone_motion.differences(yaws, motion.rate)
    return values


def euler_angles(turns: Annotated[Floats, "*rows 4"]) -> Annotated[Floats, "*rows 3"]:
    """Return roll, pitch and yaw (..., 3), rad, of quaternions Rz(yaw) Ry(pitch) Rx(roll)."""
    w, x, y, z = np.moveaxis(turns, -1, 0)
    angles = np.empty_like(turns[..., 1:])
    angles[..., 0] = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    angles[..., 1] = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
    angles[..., 2] = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return angles


def _box(motion: BoneMotion) -> Annotated[Floats, "3"]:
    """Return length, width and height, m, of an upright box around a person that turns in it."""
    sampled = slice(None, None, max(1, len(motion) // 64))
    joints, turns = motion.world(sampled)
    tips = list(motion.skeleton.tip_joints)
    tip_positions = joints[:, tips] + quat.rotate(turns[:, tips], motion.skeleton.tip_offsets)
    reach = np.concatenate([joints, tip_positions], axis=1) - motion.roots[sampled, None] * (
        1.0 - UP
    )
    side = 2.0 * float(np.hypot(reach[..., 0], reach[..., 2]).max())
    return np.array([side, side, float(reach[..., 1].max())]) + MARGIN


@dataclass(frozen=True)
class TraceFile:
    """Places of people in a trace.

    layouts: of the people (N,). presence (N, 2): their first frame, and the one after the last.
    heads: of the messages (F,). begins: of the messages in the file (F + 1,).
    """

    layouts: Sequence[Layout]
    presence: Indices
    heads: Sequence[bytes]
    begins: Indices

    def people_begins(self, first: int) -> Indices:
        """Return where in the file people from number `first` on begin in each message (F,)."""
        before = _sizes(self.layouts[:first], self.presence[:first], len(self.heads))
        heads: Indices = np.array([len(head) for head in self.heads])
        return self.begins[:-1] + heads + before


def _sizes(layouts: Sequence[Layout], presence: Indices, frames: int) -> Indices:
    """Return the bytes (F,) that people take in each frame."""
    changes = np.zeros(frames + 1, np.int64)
    sizes = [len(layout.data) for layout in layouts]
    np.add.at(changes, presence[:, 0], sizes)
    np.subtract.at(changes, presence[:, 1], sizes)
    return np.cumsum(changes[:-1])


def trace_file(crowd: CrowdClip) -> TraceFile:
    """Return the places of the people of a crowd in its trace."""
    layouts = [moving_object(number, name) for number, name in enumerate(bone_motion.people(crowd))]
    times, presence = bone_motion.frame_times(crowd), bone_motion.presence(crowd)
    sizes = _sizes(layouts, presence, crowd.frames)
    heads = [
        frame_head(time, size) for time, size in zip(times.tolist(), sizes.tolist(), strict=True)
    ]
    lengths = sizes + [len(head) for head in heads]
    return TraceFile(layouts, presence, heads, np.concatenate([[0], np.cumsum(lengths)]))


def write(crowd: CrowdClip, path: Path, roles: Mapping[str, str]) -> None:
    """Write a crowd as a trace. roles: of the skeleton's joints.

    Raises InvalidField for a skeleton without OSI's bones, or a message above 4 GB.
    """
    paths, trace = bone_paths(crowd.skeleton, roles), trace_file(crowd)
    with path.open("wb") as file:
        file.truncate(int(trace.begins[-1]))
        for head, begin in zip(trace.heads, trace.begins.tolist(), strict=False):
            os.pwrite(file.fileno(), head, begin)
        people = bone_motion.character_motions(crowd)
        while motions := list(islice(people, TOGETHER)):
            cancellation.check()
            write_people(trace, file.fileno(), motions, paths)


def write_people(
    trace: TraceFile, file: int, motions: Sequence[BoneMotion], paths: Sequence[tuple[int, ...]]
) -> None:
    """Write the parts of people to their places in a file, given by its descriptor."""
    indices = [motion.index for motion in motions]
    runs = np.split(np.arange(len(motions)), 1 + np.flatnonzero(np.diff(indices) != 1))
    for run in runs:
        together = [motions[number] for number in run]
        begins = trace.people_begins(together[0].index)
        firsts = [motion.first for motion in together]
        records = [person_parts(motion, trace.layouts[motion.index], paths) for motion in together]
        spans = [
            (first, first + len(rows), rows) for first, rows in zip(firsts, records, strict=True)
        ]
        for frame in range(min(firsts), max(stop for _, stop, _ in spans)):
            os.pwritev(
                file,
                [rows[frame - first] for first, end, rows in spans if first <= frame < end],
                int(begins[frame]),
            )


def person_parts(
    motion: BoneMotion, layout: Layout, paths: Sequence[tuple[int, ...]]
) -> Annotated[npt.NDArray[np.uint8], "frames bytes"]:
    """Return the bytes (F, size) of a person in each of its frames."""
    frames, size, gaps = len(motion), len(layout.data), layout.gaps
    records = np.empty((frames, size), np.uint8)
    records[:] = np.frombuffer(layout.data, np.uint8)
    headings = np.unwrap(quat.twist(motion.rotations[:, 0], UP))
    steps = size, gaps[1] - gaps[0]
    for gap, values in zip(gaps[:BASE:3], _base_numbers(motion, headings), strict=True):
        vector: Floats = np.ndarray((frames, 3), "<f8", records, gap, steps)
        vector[:] = values
    # All bones take equally many bytes, and so do their vectors.
    strides = size, *(gaps[BASE + step] - gaps[BASE] for step in (12, 3, 1))
    shape = frames, len(paths) + 1, 4, 3
    bones: Floats = np.ndarray(shape, "<f8", records, gaps[BASE], strides)
    # The root, which comes first, stays where it is in the box.
    bones[:, 0] = 0.0
    _write_bones(motion, paths, headings, bones[:, 1:])
    return records
