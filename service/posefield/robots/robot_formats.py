"""Formats of reference motions of robots: how each is known, read and written."""

import io
import json
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import PurePosixPath
from typing import IO, Any, Literal, Protocol

import numpy as np

from posefield.common.errors import MotionFileError
from posefield.robots import file_conventions, restricted_pickle
from posefield.robots import file_readers as readers
from posefield.robots import file_writers as writers
from posefield.robots.file_conventions import Content, Conventions, File
from posefield.robots.robot import Robot
from posefield.robots.robot_motion import RobotMotion

MAX_BYTES = 1_000_000_000
"""Limit of a file, and of what an archive unpacks to."""


class RobotFile(Protocol):
    """A file of a folder or of an archive."""

    @property
    def name(self) -> str:
        """Return its name."""

    def open(self, mode: Literal["rb"]) -> IO[bytes]:
        """Open it."""


@dataclass(frozen=True)
class RobotFormat:
    """Format of reference motions.

    name: its name in options, which ends in the suffix. programs: that read it. fields: that tell
    it from the others. read, write: None if it is not written, with the reason in `programs`.
    """

    name: str
    programs: str
    fields: tuple[str, ...]
    read: Callable[[File], RobotMotion]
    write: Callable[[RobotMotion, Robot], bytes] | None = None

    @property
    def suffix(self) -> str:
        """Return the suffix of its files."""
        return PurePosixPath(self.name).suffix


FORMATS = (
    RobotFormat(
        "unitree.csv", "Unitree, LAFAN1, mjlab", ("rows",), readers.from_rows, writers.write_unitree
    ),
    RobotFormat("qpos.csv", "MuJoCo, Kimodo", (), readers.from_rows, writers.write_qpos),
    RobotFormat(
        "holosoma.npz",
        "holosoma",
        ("joint_pos", "body_pos_w", "joint_names"),
        readers.from_holosoma,
        writers.write_holosoma,
    ),
    RobotFormat(
        "mjlab.npz",
        "mjlab",
        ("joint_pos", "body_pos_w", "body_quat_w"),
        readers.from_tracking,
        lambda motion, robot: writers.write_tracking(motion, robot, "depth"),
    ),
    RobotFormat(
        "beyondmimic.npz",
        "BeyondMimic",
        (),
        readers.from_tracking,
        lambda motion, robot: writers.write_tracking(motion, robot, "breadth"),
    ),
    RobotFormat(
        "isaaclab.npz",
        "Isaac Lab",
        ("dof_names", "body_names", "dof_positions"),
        readers.from_isaaclab,
        writers.write_isaaclab,
    ),
    RobotFormat(
        "locomujoco.npz",
        "LocoMuJoCo",
        ("qpos", "split_points"),
        readers.from_qpos,
        writers.write_loco,
    ),
    RobotFormat(
        "qpos.npz", "any4hdmi, OmniRetarget", ("qpos",), readers.from_qpos, writers.write_qpos_npz
    ),
    RobotFormat("loco-joints.npz", "LocoMuJoCo 0", ("q_pelvis_tx",), readers.from_loco_joints),
    RobotFormat("kimodo.npz", "Kimodo", ("posed_joints",), readers.from_kimodo),
    RobotFormat(
        "gmr.pkl",
        "GMR, TWIST",
        ("root_pos", "root_rot", "dof_pos"),
        readers.from_gmr,
        writers.write_gmr,
    ),
    RobotFormat(
        "mimickit.pkl",
        "MimicKit",
        ("loop_mode", "frames"),
        readers.from_mimickit,
        writers.write_mimickit,
    ),
    RobotFormat(
        "asap.pkl",
        "ASAP, PBHC",
        ("root_trans_offset", "dof", "root_rot"),
        readers.from_asap,
        writers.write_asap,
    ),
    RobotFormat(
        "awd.json",
        "AWD, Open Duck",
        ("Frames", "Joints", "Frame_offset"),
        readers.from_awd,
        writers.write_awd,
    ),
    RobotFormat(
        "amp.txt",
        "AMP, DeepMimic",
        ("Frames", "FrameDuration"),
        readers.from_amp,
        writers.write_amp,
    ),
    RobotFormat("tienkung.txt", "TienKung", (), readers.from_amp),
)
"""Formats in the order in which they are tried; one without fields is told by its numbers."""

WRITTEN = {form.name: form for form in FORMATS if form.write}


def of_file(name: str) -> RobotFormat | None:
    """Return the format that a file's name ends in, such as walk.mjlab.npz; None for others."""
    endings = (form for ending, form in WRITTEN.items() if name.endswith(f".{ending}"))
    return next(endings, None)


PEOPLE = "captures of people are carried onto a robot first: see 'People on a robot' of the guide"
SUFFIXES = (".csv", ".npz", ".pkl", ".json", ".txt")


def read(path: RobotFile, conventions: Conventions) -> RobotMotion:
    """Return the reference motion of a file, in the order of the robot's joints if one is given.

    Raises MotionFileError for a file that is no reference motion, whose numbers are wrong, or
    whose conventions neither its numbers nor the user tell.
    """
    content = _content(path)
    file = File(str(path), content, conventions)
    row = next((row for row in FORMATS if row.fields and set(row.fields) <= set(content)), None)
    if row is None:
        listed = ", ".join(sorted(content)[:12]) or "no fields"
        raise file.error(f"found {listed}: the fields of no known format of reference motions")
    motion = row.read(file)
    if conventions.degrees:
        motion = replace(motion, angles=np.radians(motion.angles))
    motion = motion.checked()
    if conventions.robot is None:
        return motion
    motion = motion.on(conventions.robot)
    file_conventions.expect_radians(motion, conventions)
    file_conventions.expect_floor(motion, conventions.robot)
    return motion


def _content(path: RobotFile) -> Content:
    suffix = PurePosixPath(path.name).suffix.lower()
    if suffix not in SUFFIXES:
        expected = f"expected one of {', '.join(SUFFIXES)}; {PEOPLE}"
        raise MotionFileError(str(path), f"found {suffix!r}, {expected}")
    try:
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except OSError as fault:
        raise MotionFileError(str(path), f"cannot be read: {fault.strerror}") from None
    if len(data) > MAX_BYTES:
        raise MotionFileError(str(path), f"is larger than {MAX_BYTES // 10**6} MB")
    content = PARSERS[suffix](data, str(path))
    if not isinstance(content, dict):
        raise MotionFileError(str(path), f"holds a {type(content).__name__}, expected named fields")
    # Some name their motions: a file of one is meant.
    if len(content) == 1 and isinstance(only := next(iter(content.values())), dict):
        return only
    return content


def _parse_csv(data: bytes, source: str) -> Content:
    rows = []
    for line, text in enumerate(data.decode("utf-8", "replace").splitlines(), 1):
        if not text.strip():
            continue
        try:
            rows.append([float(cell) for cell in text.split(",")])
        except ValueError:
            raise MotionFileError(source, f"found {text[:40]!r}, expected numbers", line) from None
        if len(rows[-1]) != len(rows[0]):
            raise MotionFileError(
                source, f"found {len(rows[-1])} numbers, expected {len(rows[0])}", line
            )
    return {"rows": np.array(rows, ndmin=2)}


def _parse_npz(data: bytes, source: str) -> Content:
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            size = sum(member.file_size for member in archive.infolist())
        if size > MAX_BYTES:
            raise MotionFileError(source, f"unpacks to {size // 10**6} MB, at most 1000 are read")
        with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
            return {name: arrays[name] for name in arrays.files}
    except (ValueError, OSError, zipfile.BadZipFile, EOFError) as fault:
        raise MotionFileError(source, f"is no archive of plain arrays: {fault}") from None


def _parse_json(data: bytes, source: str) -> Any:
    try:
        return json.loads(data)
    except (ValueError, RecursionError) as fault:
        raise MotionFileError(source, f"is no JSON document: {fault}") from None


PARSERS: Mapping[str, Callable[[bytes, str], Any]] = {
    ".csv": _parse_csv,
    ".npz": _parse_npz,
    ".pkl": restricted_pickle.load,
    ".json": _parse_json,
    ".txt": _parse_json,
}
