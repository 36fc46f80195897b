"""Samples of the family with noise, and their files: motions, table and recipe."""

import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import astuple, dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np
from numpy.random import PCG64, Generator

from posefield.common.errors import FileError
from posefield.common.units import Floats
from posefield.motion import quat
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton
from posefield_train.sample import noise_free, sample_body, sample_controls
from posefield_train.sample.sample_controls import RANGES, STATURES, SampleControls, TimingWarp
from posefield_train.source import clip_table

COUNT = 92
RATE = 120.0
SEED = 2006
_GROUPS = 2 * len(STATURES)

NOISE = np.radians(0.4)
"""Root mean square of the noise about each axis over a clip, rad."""

_LEG_SHARE = 0.5
"""Share of the noise for pelvis and legs, which are steadier when standing or sitting."""

_DURATION_SPREAD = 0.04
_WARP_SPREAD = 0.05
_HARMONICS = np.array([0.5, 1.0, 1.5, 2.0])
"""Frequencies of the noise, cycles per clip."""


@dataclass(frozen=True)
class SampleTrial:
    """One trial: performer, nominal controls, and the noisy motion."""

    performer: str
    controls: SampleControls
    clip: Clip


def _spread(group: int, index: int, size: int) -> Floats:
    """Return a point (3,) of a group's Fibonacci lattice over turn and target height.

    The third component is for the hip height. The groups' lattices are shifted against each other,
    so that together they fill the gaps.
    """
    offset = (group + 0.5) / _GROUPS
    turn = (index + offset) / size
    height = np.mod(offset + index * 0.5 * (np.sqrt(5.0) - 1.0), 1.0)
    return np.array([turn, height, np.mod(0.5 + index * np.sqrt(2.0), 1.0)])


def _trial_controls(stature: float, standing: bool, spread: Floats) -> SampleControls:
    low, high = sample_controls.limits("hip_height", stature, 0.0)
    band = (
        (high - sample_controls.STAND_RANGE, high)
        if standing
        else (low, low + 2 * sample_controls.SEAT_RANGE)
    )
    hip = _rounded(float(np.interp(spread[2], (0, 1), band)), low, high)
    values = []
    for name, share in zip(("turn", "target_height"), spread, strict=False):
        limits = sample_controls.limits(name, stature, hip)
        values.append(_rounded(float(np.interp(share, (0, 1), limits)), *limits))
    return SampleControls(stature, hip, *values)


def _rounded(value: float, low: float, high: float) -> float:
    """Return a value of a control with the table's four decimals, within its limits."""
    rounded, step = round(value, 4), 1e-4
    if rounded > high:
        return round(rounded - step, 4)
    return round(rounded + step, 4) if rounded < low else rounded


def design(count: int = COUNT) -> Iterator[tuple[str, SampleControls]]:
    """Yield performer and controls of each of `count` samples.

    By stature, each standing, then sitting. Families of different sizes share no control points.
    """
    groups = product(STATURES, (True, False))
    for group, (name, standing) in enumerate(groups):
        size = len(range(group, count, _GROUPS))
        for index in range(size):
            yield name, _trial_controls(STATURES[name], standing, _spread(group, index, size))


def smooth_noise(rng: Generator, frames: int, shape: tuple[int, int]) -> Floats:
    """Return noise (frames, *shape), rad: slow sinusoids of random phase and amplitude."""
    size = NOISE * rng.standard_normal((len(_HARMONICS), *shape)) * np.sqrt(2 / len(_HARMONICS))
    phase = rng.uniform(0.0, 2.0 * np.pi, size.shape)
    elapsed = np.arange(frames) / (frames - 1)
    cycles = 2.0 * np.pi * np.multiply.outer(elapsed, _HARMONICS)
    waves = np.sin(cycles[:, :, None, None] + phase)
    noise: Floats = np.einsum("fh...,h...->f...", waves, size)
    return noise


def _noise_shares() -> Floats:
    """Return the share (J, 3) of the noise for each axis of each joint; hinges have one axis."""
    share = np.ones((len(sample_body.NAMES), 3))
    share[[sample_body.INDEX[name] for name in sample_body.HINGES], 1:] = 0.0
    share[: sample_body.INDEX["LowerBack"]] *= _LEG_SHARE
    return share


def _add_noise(clip: Clip, rng: Generator) -> Clip:
    noise = smooth_noise(rng, len(clip), (len(sample_body.NAMES), 3)) * _noise_shares()
    return replace(clip, rotations=quat.mul(clip.rotations, quat.exp(noise)))


def noisy_trial(where: SampleControls, rng: Generator) -> Clip:
    """Return one noisy trial: the true motion with varied duration, timing and rotations."""
    seconds = noise_free.duration(astuple(where))
    pace = noise_free.warp(where)
    late = np.exp(_DURATION_SPREAD * rng.standard_normal())
    da, db = _WARP_SPREAD * rng.standard_normal(2)
    played = noise_free.synthesize(
        where, seconds * late, TimingWarp(pace.a + da, pace.b + db), RATE
    )
    return _add_noise(played, rng)


def samples(count: int = COUNT, seed: int = SEED) -> Iterator[SampleTrial]:
    """Yield `count` samples in order; every call yields the same.

    seed: of the noise; the control points do not depend on it.
    """
    rng = Generator(PCG64(seed))
    for performer, where in design(count):
        yield SampleTrial(performer, where, noisy_trial(where, rng))


_RECIPE = """\
schema = 1
name = "reaching"
description = "Procedural reaching motions of three performers, standing and sitting"
licence = "CC0-1.0"
truth = "reaching"

[source]
metres_per_unit = 1.0
up = "y"
root_offset = "replace"

[clips]
table = "clips.csv"
file = "file"
performer = "performer"
{controls}
[motion]
frames = 100
cyclic = false
root = "travelling"

[event]
joint = "RightHand"
at = "end"

[roles]
hips = "Hips"
spine = "LowerBack"
chest = "Spine"
upperChest = "Spine1"
neck = "Neck"
head = "Head"
leftShoulder = "LeftShoulder"
leftUpperArm = "LeftArm"
leftLowerArm = "LeftForeArm"
leftHand = "LeftHand"
leftUpperLeg = "LeftUpLeg"
leftLowerLeg = "LeftLeg"
leftFoot = "LeftFoot"
leftToes = "LeftToeBase"
rightShoulder = "RightShoulder"
rightUpperArm = "RightArm"
rightLowerArm = "RightForeArm"
rightHand = "RightHand"
rightUpperLeg = "RightUpLeg"
rightLowerLeg = "RightLeg"
rightFoot = "RightFoot"
rightToes = "RightToeBase"

[presets.high_shelf]
stature = 1.75
hip_height = 0.95
turn = 10.0
target_height = 1.75

[presets.to_the_side]
stature = 1.75
hip_height = 0.95
turn = 60.0
target_height = 1.2

[presets.seated]
stature = 1.75
hip_height = 0.52
turn = 20.0
target_height = 0.9

[size]
rms_budget_cm = 0.5
"""

_CONTROL = """
[[controls]]
name = "{name}"
column = "{name}"
unit = "{unit}"
description = "{description}"
"""

_BALL = "Zrotation Yrotation Xrotation"


def _files(chosen: Iterable[SampleTrial]) -> dict[str, bytes]:
    files: dict[str, bytes] = {}
    rows = [["file", "performer", *RANGES, "event_frame"]]
    for number, sample in enumerate(chosen, start=1):
        path = f"bvh/reach_{number:03}.bvh"
        files[path] = bvh_text(sample.clip).encode()
        rows.append(_row(path, sample))
    return files | {
        "clips.csv": clip_table.csv_text(rows).encode(),
        "recipe.toml": _recipe().encode(),
    }


def write_family(output: Path, chosen: Iterable[SampleTrial] | None = None) -> Path:
    """Write samples to a directory atomically and return their recipe's path.

    chosen: samples; default: the family's 92. A directory with exactly these files is left
    unchanged; raises FileError for an existing file, or a directory with other content.
    """
    return write_folder(output, _files(samples() if chosen is None else chosen))


def write_folder(output: Path, files: dict[str, bytes]) -> Path:
    """Write files by path relative to a directory, atomically; return the path of recipe.toml.

    A directory with exactly these files is left unchanged; raises FileError for an existing file,
    or a directory with other content.
    """
    if output.exists() and not output.is_dir():
        raise FileError(output, "found a file, expected a new or empty directory")
    if output.is_dir() and any(output.iterdir()):
        _expect_same(output, files)
    else:
        _write_files(output, files)
    return output / "recipe.toml"


def _write_files(output: Path, files: dict[str, bytes]) -> None:
    output.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=output.parent, prefix=f".{output.name}-") as scratch:
        # A subdirectory, because the temporary directory is readable by its owner only.
        family_folder = Path(scratch) / "family"
        for path, content in files.items():
            (family_folder / path).parent.mkdir(parents=True, exist_ok=True)
            (family_folder / path).write_bytes(content)
        family_folder.rename(output)


def _expect_same(output: Path, files: dict[str, bytes]) -> None:
    paths = {path.relative_to(output).as_posix() for path in output.rglob("*") if path.is_file()}
    for path in sorted(paths ^ files.keys()):
        state = "is in the way" if path in paths else "is missing"
        raise FileError(output, f"not empty and not this family: {path} {state}")
    for path, content in files.items():
        if (output / path).read_bytes() != content:
            raise FileError(output, f"not empty and not this family: {path} differs")


def _recipe() -> str:
    sections = [
        _CONTROL.format(name=name, unit=unit, description=description)
        for name, (_, _, unit, description) in RANGES.items()
    ]
    return _RECIPE.format(controls="".join(sections))


def _row(path: str, sample: SampleTrial) -> list[str]:
    point = [f"{value:.4f}" for value in astuple(sample.controls)]
    return [path, sample.performer, *point, str(len(sample.clip) - 1)]


def bvh_text(clip: Clip) -> str:
    """Return the BVH text of a clip of the family, in metres.

    Hinges have one channel, other joints three. The root's offset is zero; its channels contain its
    whole path.
    """
    head = "\n".join(["HIERARCHY", *_joint(clip.skeleton, 0), "MOTION"])
    lines = (" ".join(f"{value:.6f}" for value in row) for row in _channels(clip).tolist())
    rate = f"Frames: {len(clip)}\nFrame Time: {1.0 / clip.rate:.12f}"
    return "\n".join([head, rate, *lines]) + "\n"


def _offset(indent: str, offset: Floats) -> str:
    x, y, z = offset + 0.0
    return f"{indent}OFFSET {x:.6f} {y:.6f} {z:.6f}"


def _joint(figure: Skeleton, joint: int, depth: int = 0) -> Iterator[str]:
    outer, inner = "  " * depth, "  " * (depth + 1)
    yield f"{outer}{'JOINT' if joint else 'ROOT'} {figure.names[joint]}"
    yield f"{outer}{{"
    yield _offset(inner, figure.offsets[joint] if joint else np.zeros(3))
    yield f"{inner}CHANNELS {_channel_names(figure, joint)}"
    for child, parent in enumerate(figure.parents):
        if parent == joint:
            yield from _joint(figure, child, depth + 1)
    for holder, tip in zip(figure.tip_joints, figure.tip_offsets, strict=True):
        if holder == joint:
            yield from (f"{inner}End Site", f"{inner}{{", _offset(inner + "  ", tip), f"{inner}}}")
    yield f"{outer}}}"


def _channel_names(figure: Skeleton, joint: int) -> str:
    if joint == 0:
        return f"6 Xposition Yposition Zposition {_BALL}"
    return "1 Xrotation" if figure.names[joint] in sample_body.HINGES else f"3 {_BALL}"


def _channels(clip: Clip) -> Floats:
    """Return values (F, 94) as printed: m and degrees, minus zero as zero."""
    columns = [clip.root_path]
    for joint, name in enumerate(clip.skeleton.names):
        turn = clip.rotations[:, joint]
        if name in sample_body.HINGES:
            angles = quat.twist(turn, np.array([1.0, 0.0, 0.0]))[:, None]
        else:
            angles = np.unwrap(quat.to_euler(turn, "ZYX"), axis=0)
        columns.append(np.degrees(angles))
    values: Floats = np.concatenate(columns, axis=1)
    return values.round(6) + 0.0
