"""People of Kimodo's NPZ files: the joints of SOMA, with positions and rotations in the world.

Files state neither names nor parents of joints: their number tells the skeleton. Lengths are metres
and Y is up; a rate is not stated.
"""

import io
import zipfile

import numpy as np

from posefield.common.errors import MotionFileError
from posefield.motion import quat
from posefield.motion.skeleton import Skeleton
from posefield_train.source import data_folder
from posefield_train.source.data_folder import FileLocation
from posefield_train.source.motion_file import MotionFile, ReadOptions

MAX_BYTES = 1_000_000_000
FINGERS = ("Index", "Middle", "Ring", "Pinky")


def _hand(side: str) -> list[tuple[str, str]]:
    hand = f"{side}Hand"
    chains = [["Thumb1", "Thumb2", "Thumb3", "ThumbEnd"]]
    chains += [[f"{finger}{part}" for part in (*range(1, 5), "End")] for finger in FINGERS]
    pairs = []
    for chain in chains:
        names = [hand, *(hand + part for part in chain)]
        pairs += list(zip(names[1:], names[:-1], strict=True))
    return pairs


def _arm(side: str, hand: list[tuple[str, str]]) -> list[tuple[str, str]]:
    chain = ["Chest", *(side + part for part in ("Shoulder", "Arm", "ForeArm", "Hand"))]
    return [*zip(chain[1:], chain[:-1], strict=True), *hand]


def _leg(side: str, *toes: str) -> list[tuple[str, str]]:
    chain = ["Hips", *(side + part for part in ("Leg", "Shin", "Foot", "ToeBase", *toes))]
    return list(zip(chain[1:], chain[:-1], strict=True))


SPINE = [
    *(("Hips", ""), ("Spine1", "Hips"), ("Spine2", "Spine1"), ("Chest", "Spine2")),
    *(("Neck1", "Chest"), ("Neck2", "Neck1"), ("Head", "Neck2")),
]
FACE = [("Jaw", "Head"), ("LeftEye", "Head"), ("RightEye", "Head")]
SOMA = [
    *(*SPINE, ("HeadEnd", "Head"), *FACE),
    *(*_arm("Left", _hand("Left")), *_arm("Right", _hand("Right"))),
    *(*_leg("Left", "ToeEnd"), *_leg("Right", "ToeEnd")),
]
SMALL_SOMA = [
    *(*SPINE, *FACE),
    *_arm("Left", [(f"LeftHand{tip}End", "LeftHand") for tip in ("Thumb", "Middle")]),
    *_arm("Right", [(f"RightHand{tip}End", "RightHand") for tip in ("Thumb", "Middle")]),
    *(*_leg("Left"), *_leg("Right")),
]
SKELETONS = {len(pairs): pairs for pairs in (SMALL_SOMA, SOMA)}
"""Joints with their parents, by the number of joints of a file."""
ROBOT_JOINTS = 34
RIGID = 0.02
"""Largest change of a bone's length, m, in a file of the skeleton."""


def read(file: FileLocation, options: ReadOptions) -> MotionFile:
    """Return the motion of a person.

    Raises MotionFileError for a file that is no motion of Kimodo, or whose joints are not SOMA's.
    """
    source = str(file)
    fields = _fields(data_folder.read(file, MAX_BYTES, "a motion of Kimodo"), source)
    positions, matrices = (
        _numbers(fields, name, rank, source)
        for name, rank in (("posed_joints", 3), ("global_rot_mats", 4))
    )
    pairs = SKELETONS.get(positions.shape[1])
    if pairs is None or matrices.shape != (*positions.shape, 3):
        robot = "; 34 are the robot G1's, which a recipe with [robot] reads"
        raise MotionFileError(
            source,
            f"found {positions.shape[1]} joints and rotations {matrices.shape}, expected those of "
            f"SOMA, {' or '.join(map(str, SKELETONS))} joints"
            + (robot if positions.shape[1] == ROBOT_JOINTS else ""),
        )
    names = [name for name, _ in pairs]
    parents = tuple(names.index(parent) if parent else -1 for _, parent in pairs)
    turns = quat.from_matrix(matrices)
    rows = list(parents[1:])
    inverse = quat.conj(turns[:, rows])
    bones = quat.rotate(inverse, positions[:, 1:] - positions[:, rows])
    change = float(np.abs(bones - bones.mean(axis=0)).max(initial=0.0))
    if change > RIGID:
        raise MotionFileError(
            source,
            f"bones change by {100 * change:.1f} cm, expected those of SOMA, which are rigid",
        )
    offsets = np.concatenate([np.zeros((1, 3)), bones.mean(axis=0)])
    rotations = np.concatenate([turns[:, :1], quat.mul(inverse, turns[:, 1:])], axis=1)
    translations = np.tile(offsets, (len(positions), 1, 1))
    translations[:, 0] = positions[:, 0]
    skeleton = Skeleton(tuple(names), parents, offsets, (), np.zeros((0, 3)))
    rate = options.rate
    return MotionFile(
        source,
        "Kimodo",
        skeleton,
        quat.unroll(rotations),
        translations,
        rate,
        "source.rate",
        metres_per_unit=1.0,
        up="y",
    )


def _fields(content: bytes, source: str) -> dict[str, np.ndarray]:
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            size = sum(member.file_size for member in archive.infolist())
        if size > MAX_BYTES:
            raise MotionFileError(source, f"unpacks to {size // 10**6} MB, at most 1000 are read")
        with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
            fields = {name: arrays[name] for name in arrays.files}
    except (ValueError, OSError, zipfile.BadZipFile, EOFError) as fault:
        raise MotionFileError(source, f"is no archive of plain arrays: {fault}") from None
    if {"poses", "trans"} <= fields.keys():
        raise MotionFileError(
            source,
            "SMPL parameters, such as those of AMASS, need a body model for the bones' lengths: "
            "export them with it as BVH or GLB",
        )
    return fields


def _numbers(fields: dict[str, np.ndarray], name: str, rank: int, source: str) -> np.ndarray:
    values = fields.get(name)
    if values is None or values.ndim != rank or values.shape[-1] != 3 or not len(values):
        shape = "none" if values is None else str(values.shape)
        raise MotionFileError(
            source,
            f"found {shape} as field {name!r}, expected {rank} axes, the last of 3 (Kimodo); "
            "reference motions of robots are read by posefield doctor",
        )
    numbers = np.asarray(values, dtype=np.float64)
    if not np.isfinite(numbers).all():
        frame = int(np.argwhere(~np.isfinite(numbers))[0][0])
        raise MotionFileError(source, f"{name} of frame {frame} holds numbers that are not finite")
    return numbers
