"""Walks of the CMU database, recognized by their motion: ASF and AMC files, or BVH, to BVH.

The strides were cut from copies of the trials that do not all name the trial. A file is therefore
recognized by its number of frames and by the length of every stride in the table, for which the
table's own cuts have to fit. A BVH file may begin with a T-pose, which the widespread conversion by
B. Hahne (cgspeed) puts before the first frame.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path, PurePosixPath

import numpy as np

from posefield.common.errors import AcclaimError
from posefield.motion import bvh_writer
from posefield.motion.clip import Clip
from posefield_train.source import acclaim, bvh
from recipe_data import data_sets
from recipe_data.data_sets import CMU, Fetched, FetchedFile

RATE = 120.0
"""Frames a second of the walks; AMC files do not state it."""

METRES_PER_UNIT = 0.0564444
"""As in the recipe. Numbers are written in the unit of the files, 1/0.45 inches."""

STRIDE_TOLERANCE = 0.001
"""Largest difference between a stride's length and the table's, m; its step is 0.001 m."""

NAME = re.compile(r"(\d{1,3})_(\d{1,3})\.(?:amc|bvh)", re.IGNORECASE)
BVH_FRAMES = re.compile(rb"^\s*Frames\s*:\s*(\d+)", re.IGNORECASE | re.MULTILINE)
AMC_FRAMES = re.compile(rb"^root\s", re.MULTILINE)

JOINTS = dict(
    pair.split("=")
    for pair in (
        "root=Hips lhipjoint=LHipJoint lfemur=LeftUpLeg ltibia=LeftLeg lfoot=LeftFoot "
        "ltoes=LeftToeBase rhipjoint=RHipJoint rfemur=RightUpLeg rtibia=RightLeg rfoot=RightFoot "
        "rtoes=RightToeBase lowerback=LowerBack upperback=Spine thorax=Spine1 lowerneck=Neck "
        "upperneck=Neck1 head=Head lclavicle=LeftShoulder lhumerus=LeftArm lradius=LeftForeArm "
        "lwrist=LeftHand lhand=LeftFingerBase lfingers=LeftHandIndex1 lthumb=LThumb "
        "rclavicle=RightShoulder rhumerus=RightArm rradius=RightForeArm rwrist=RightHand "
        "rhand=RightFingerBase rfingers=RightHandIndex1 rthumb=RThumb"
    ).split()
)
"""Names of the recipe's joints by those of the ASF files."""


@dataclass(frozen=True)
class Trial:
    """A file of one trial. subject, number: of its name. skeleton: ASF file; None for BVH."""

    path: Path
    subject: int
    number: int
    skeleton: Path | None


@dataclass(frozen=True)
class Stride:
    """A stride of the table: its frames, and its length over the floor, m."""

    first: int
    last: int
    length: float


def convert(source: Path) -> Fetched:
    """Return the walks of the shipped table that lie anywhere below a folder, as BVH.

    A walk with several different matches is missing, with their names as the reason. Raises
    FileError for a folder without motion files, and for one that breaks its grammar.
    """
    present = data_sets.motion_files(source)
    trials, hashes = list(_trials(present)), CMU.hashes()
    strides: dict[str, list[Stride]] = {}
    for row in CMU.rows(CMU.table):
        cut = Stride(int(row["start_frame"]), int(row["end_frame"]), float(row["stride_m"]))
        strides.setdefault(row["file"], []).append(cut)
    files, missing = [], {}
    for row in CMU.rows("clips.csv"):
        if row["file"] not in strides:
            continue
        converted = _copied(row["file"], present, hashes) or _recognized(row, strides, trials)
        if isinstance(converted, str):
            missing[row["file"]] = converted
        else:
            files.append(converted)
    return Fetched(tuple(files), missing)


def _trials(present: dict[str, list[Path]]) -> Iterator[Trial]:
    """Yield the files named after subject and trial, such as 07_01.amc with 07.asf."""
    skeletons = {int(Path(name).stem): paths for name, paths in present.items() if _is_asf(name)}
    for name, paths in present.items():
        if not (matched := NAME.fullmatch(name)):
            continue
        subject, number = int(matched[1]), int(matched[2])
        path = data_sets.only(paths)
        if path.suffix.lower() == ".bvh":
            yield Trial(path, subject, number, None)
        elif subject in skeletons:
            yield Trial(path, subject, number, data_sets.only(skeletons[subject]))
        else:
            raise AcclaimError(path, f"found no skeleton {subject:02}.asf for it, expected one")


def _is_asf(name: str) -> bool:
    return bool(re.fullmatch(r"\d{1,3}\.asf", name))


def _copied(
    file: str, present: dict[str, list[Path]], hashes: dict[str, str]
) -> FetchedFile | None:
    """Return the very file of which the table was measured; None if it is not there."""
    for path in present.get(PurePosixPath(file).name.lower(), ()):
        content = path.read_bytes()
        if data_sets.sha256(content) == hashes[file]:
            return FetchedFile(file, (path,), content)
    return None


def _recognized(
    row: dict[str, str], strides: dict[str, list[Stride]], trials: Sequence[Trial]
) -> FetchedFile | str:
    """Return the walk of a row of clips.csv, or why there is none."""
    subject = row["performer"].removeprefix("cmu_")
    candidates = [one for one in trials if not subject.isdecimal() or one.subject == int(subject)]
    matches: dict[tuple[int, int], tuple[Trial, Clip]] = {}
    for trial in candidates:
        clip = _clip(trial, int(row["frames"]))
        if clip is not None and _fits(clip, strides[row["file"]]):
            matches.setdefault((trial.subject, trial.number), (trial, clip))
    if len(matches) != 1:
        names = ", ".join(trial.path.name for trial, _ in matches.values())
        description = f"a trial of subject {subject}" if subject.isdecimal() else "a trial"
        if matches:
            return f"found {names} with these strides, expected one trial"
        return f"found no match, expected {description} of {row['frames']} frames"
    ((trial, clip),) = matches.values()
    sources = (trial.path,) if trial.skeleton is None else (trial.skeleton, trial.path)
    content = bvh_writer.dumps(clip, metres_per_unit=METRES_PER_UNIT)
    return FetchedFile(row["file"], sources, content)


def _clip(trial: Trial, frames: int) -> Clip | None:
    """Return the motion of a trial with this number of frames; None if it has another number."""
    extra = _frames(trial.path) - frames
    if extra == 0:
        return _read(trial)
    if extra != 1 or trial.skeleton is not None:
        return None
    clip = _read(trial)
    rotations, translations = clip.rotations[1:], clip.translations[1:]
    return replace(clip, rotations=rotations, translations=translations)


@lru_cache(maxsize=10_000)
def _frames(path: Path) -> int:
    """Return the number of frames of a file, -1 if it does not state one, without parsing it."""
    content = path.read_bytes()
    if path.suffix.lower() == ".amc":
        return len(AMC_FRAMES.findall(content))
    stated = BVH_FRAMES.search(content)
    return int(stated[1]) if stated else -1


@lru_cache(maxsize=16)
def _read(trial: Trial) -> Clip:
    """Return the motion of a trial, with the recipe's names of joints."""
    if trial.skeleton is None:
        file = bvh.read(trial.path)
        return bvh.to_clip(file, metres_per_unit=METRES_PER_UNIT, up="y", root_offset="replace")
    skeleton = acclaim.read_asf(trial.skeleton)
    motion = acclaim.read_amc(trial.path, skeleton)
    clip = acclaim.to_clip(skeleton, motion, metres_per_unit=METRES_PER_UNIT, rate=RATE)
    if set(clip.skeleton.names) != JOINTS.keys():
        other = sorted(set(clip.skeleton.names) ^ JOINTS.keys())
        raise AcclaimError(trial.skeleton, f"only it or the recipe has the bones {other}")
    names = tuple(JOINTS[name] for name in clip.skeleton.names)
    return replace(clip, skeleton=replace(clip.skeleton, names=names))


def _fits(clip: Clip, strides: Sequence[Stride]) -> bool:
    """Return True if every stride of the table has its length in the clip."""
    for stride in strides:
        if stride.last >= len(clip):
            return False
        travel = (clip.root_path[stride.last] - clip.root_path[stride.first])[[0, 2]]
        if abs(float(np.linalg.norm(travel)) - stride.length) > STRIDE_TOLERANCE:
            return False
    return True
