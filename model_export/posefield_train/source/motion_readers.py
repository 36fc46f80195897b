"""Readers of motion files by suffix, and the files of a run, each read once."""

import shutil
import tempfile
from collections import OrderedDict
from collections.abc import Callable, Container
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePosixPath

from posefield.common.errors import AcclaimError, FileError, MotionFileError
from posefield.robots import robot_clip, robot_formats
from posefield.robots.file_conventions import Conventions
from posefield_train.source import acclaim, bvh, data_folder, kimodo
from posefield_train.source.data_folder import FileLocation
from posefield_train.source.motion_file import (
    AS_STATED,
    MotionFile,
    ReadOptions,
    doubted_rate,
    overrule,
)

MAX_GLTF_BYTES = 1_000_000_000
"""Limit of a glTF file or buffer: the project's own take 0.5 MB for a minute."""

Read = Callable[[FileLocation, ReadOptions], MotionFile]


@dataclass(frozen=True)
class MotionFormat:
    """Format of motion files.

    suffixes: of file names, in lower case. states: what its files say of unit, up axis and rate.
    several: whether a file may hold several animations.
    """

    name: str
    suffixes: tuple[str, ...]
    read: Read
    states: str
    several: bool = False


def _read_acclaim(file: FileLocation, options: ReadOptions) -> MotionFile:
    skeletons = [name for name in data_folder.names_beside(file) if _suffix(name) == ".asf"]
    stem = PurePosixPath(file.name).stem.lower()
    matching = [name for name in skeletons if stem.startswith(PurePosixPath(name).stem.lower())]
    candidates = sorted(matching, key=len)[-1:] or (skeletons if len(skeletons) == 1 else [])
    if not candidates:
        listed = ", ".join(skeletons[:10]) or "none"
        raise AcclaimError(
            str(file),
            f"found the skeletons {listed} beside it, expected one .asf file, or one whose name "
            "begins that of the motion",
        )
    skeleton = acclaim.read_asf(data_folder.beside(file, candidates[0]))
    motion = acclaim.read_amc(file, skeleton)
    clip = acclaim.to_clip(skeleton, motion, metres_per_unit=1.0, rate=1)
    note = f"{file.name}: read with the skeleton {candidates[0]}"
    return MotionFile(
        str(file),
        "Acclaim",
        clip.skeleton,
        clip.rotations,
        clip.translations,
        options.rate,
        "source.rate",
        notes=(note, *skeleton.notes, *motion.notes),
    )


def _read_gltf(file: FileLocation, options: ReadOptions) -> MotionFile:
    # pygltflib takes 0.1 s to import, and most folders hold no glTF.
    from posefield_train.source import gltf_motion

    def beside(name: str) -> bytes:
        return data_folder.read(data_folder.beside(file, name), MAX_GLTF_BYTES, "a buffer")

    content = data_folder.read(file, MAX_GLTF_BYTES, "a glTF file")
    return gltf_motion.read(content, str(file), beside, options)


def _read_usd(file: FileLocation, options: ReadOptions) -> MotionFile:
    from posefield_train.source import usd_motion

    if isinstance(file, Path):
        # USD's own error of a file that cannot be read names no reason.
        try:
            file.open("rb").close()
        except OSError as fault:
            raise MotionFileError(str(file), f"cannot be read: {fault.strerror}") from fault
        return usd_motion.read(file, str(file), options)
    # USD opens files by name only; references to other files of the archive are not found.
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder, file.name)
        with file.open("rb") as packed, copy.open("wb") as plain:
            shutil.copyfileobj(packed, plain)
        return usd_motion.read(copy, str(file), options)


def _read_robot(file: FileLocation, conventions: Conventions) -> MotionFile:
    """Return the motion of a robot's joints, which has Y up and faces +Z."""
    motion = robot_formats.read(file, conventions)
    assert conventions.robot is not None
    body = robot_clip.of(conventions.robot)
    rotations, translations = body.joint_motion(motion)
    return MotionFile(
        str(file),
        motion.format,
        body.skeleton,
        rotations,
        translations,
        motion.rate,
        motion.evidence["rate"],
        metres_per_unit=1.0,
        up="y",
    )


FORMATS = (
    MotionFormat(
        "BVH",
        (".bvh",),
        lambda file, _: bvh.motion_file(bvh.read(file)),
        "the rate; neither unit nor up axis",
    ),
    MotionFormat("Acclaim", (".amc",), _read_acclaim, "neither unit, up axis nor rate"),
    MotionFormat(
        "glTF", (".glb", ".gltf"), _read_gltf, "metres, y up, times of keys", several=True
    ),
    MotionFormat("Kimodo", (".npz",), kimodo.read, "metres and y up, but no rate"),
    MotionFormat(
        "USD",
        (".usd", ".usda", ".usdc", ".usdz"),
        _read_usd,
        "unit, up axis and time codes a second",
        several=True,
    ),
)
"""Formats that are read, by the suffix of the file's name."""
SUFFIXES = {suffix: motion_format for motion_format in FORMATS for suffix in motion_format.suffixes}

REFUSED = {
    ".fbx": "FBX is read through Blender: posefield convert FILE.fbx -o FILE.bvh",
    ".c3d": "C3D holds markers, not a skeleton: solve them in the capture software and export BVH",
    ".npy": "numpy arrays of features, such as those of HumanML3D, hold no joint rotations of a "
    "capture: use the BVH, AMC or SMPL source of the data set",
    ".asf": "ASF holds a skeleton alone: name the .amc file, which is read with it",
    ".blend": "a Blender scene: export its armature as BVH or GLB",
    ".trc": "TRC holds markers, not a skeleton: solve them and export BVH",
    ".mvnx": "MVNX is not read: export BVH or FBX from the capture software",
}
"""Formats that are refused, with the way out."""


def read(file: FileLocation, options: ReadOptions = AS_STATED) -> MotionFile:
    """Return the motion of a file by the suffix of its name.

    Raises MotionFileError for a format that is not read, with the way out, for an animation chosen
    in a format with one motion a file, and for a file that cannot be read.
    """
    if options.robot:
        return _read_robot(file, options.robot)
    suffix = _suffix(file.name)
    motion_format = SUFFIXES.get(suffix)
    if motion_format is None:
        suffixes = ", ".join(SUFFIXES)
        fault = REFUSED.get(suffix, f"found the suffix {suffix!r}, expected one of {suffixes}")
        raise MotionFileError(str(file), fault)
    if options.animation is not None and not motion_format.several:
        raise MotionFileError(
            str(file),
            f"found animation {options.animation!r}, but {motion_format.name} files hold one "
            "motion: expected an empty cell",
        )
    motion = overrule(motion_format.read(file, options), options)
    _, doubt = doubted_rate(motion.rate) if motion.rate else (None, "")
    return replace(motion, notes=(*motion.notes, doubt)) if doubt else motion


def reason(fault: FileError, file: Path) -> str:
    """Return why a file was refused, without its name where the fault is in the file itself."""
    if fault.path != str(file):
        return str(fault)
    return fault.message if fault.line is None else f"line {fault.line}: {fault.message}"


def _suffix(name: str) -> str:
    return PurePosixPath(name).suffix.lower()


def find_files(folder: Path) -> list[Path]:
    """Return the motion files in a folder and its subfolders, in order of their paths."""
    return _files_with(folder, SUFFIXES)


def find_refused(folder: Path) -> dict[Path, str]:
    """Return the files below a folder in formats that are refused, each with the way out."""
    # A skeleton of Acclaim is read with the motion beside it.
    reasons = {suffix: way_out for suffix, way_out in REFUSED.items() if suffix != ".asf"}
    return {path: reasons[_suffix(path.name)] for path in _files_with(folder, reasons)}


def _files_with(folder: Path, suffixes: Container[str]) -> list[Path]:
    paths = (path for path in folder.rglob("*") if _suffix(path.name) in suffixes)
    return sorted(path for path in paths if not path.is_dir())


@dataclass
class MotionFiles:
    """Motion files of a run by place, each read once.

    most_poses: frames times joints that are kept, the files asked for last; None keeps all files. A
    file that was dropped is read again.
    """

    most_poses: int | None = None
    _kept: "OrderedDict[tuple[str, ReadOptions], MotionFile]" = field(default_factory=OrderedDict)
    _poses: int = 0

    def read(self, file: FileLocation, options: ReadOptions = AS_STATED) -> MotionFile:
        """Return the motion of a file, as `read`."""
        key = (str(file), options)
        motion = self._kept.pop(key, None)
        if motion is None:
            motion = read(file, options)
            self._poses += motion.poses
        self._kept[key] = motion
        limit = self.most_poses
        while limit is not None and len(self._kept) > 1 and self._poses > limit:
            _, oldest = self._kept.popitem(last=False)
            self._poses -= oldest.poses
        return motion
