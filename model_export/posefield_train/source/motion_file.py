"""Motion of a file in its own unit and axes, its frame rate, and its conversion to a clip."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from typing import Literal

import numpy as np

from posefield.common.errors import MotionFileError
from posefield.common.units import Floats, Positions, Rotations, UpAxis
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton
from posefield.rigs.rest_joints import JointTree
from posefield.robots.file_conventions import Conventions as RobotConventions

BROADCAST_RATES = tuple(1000.0 * base / 1001.0 for base in (24, 30, 60, 120))
RATE_TOLERANCE = 1e-4
"""Relative error of a frame time cut to few digits, such as .008333 or 0.0333333."""
USUAL_RATES = (
    *(10.0, 12.0, 15.0, 20.0, 24.0, 25.0, 30.0, 48.0, 50.0, 60.0, 72.0, 75.0),
    *(90.0, 100.0, 120.0, 144.0, 200.0, 240.0, 250.0),
)
"""Frames a second of cameras, games and captures."""
LEAST_PLAUSIBLE, MOST_PLAUSIBLE = 5.0, 1000.0
"""Frames a second beyond which a stated rate is doubted."""


def snapped_rate(frame_time: float) -> float:
    """Return frames per second: the nearest whole or broadcast rate within the tolerance.

    Otherwise the inverse of the frame time.
    """
    rate = 1.0 / float(frame_time)
    nearest = min((max(1.0, float(round(rate))), *BROADCAST_RATES), key=lambda c: abs(c - rate))
    return nearest if abs(nearest - rate) <= RATE_TOLERANCE * nearest else rate


def rate_of_digits(frame_time: str) -> tuple[float, tuple[str, ...]]:
    """Return frames per second of a frame time as written, s, and a note on digits cut off.

    A time such as 0.033 stands for all that are rounded or cut to its digits: of the usual rates
    among them the nearest is taken, whole ones first.
    """
    seconds = Decimal(frame_time)
    exact, digit = (
        snapped_rate(float(seconds)),
        float(Decimal(1).scaleb(int(seconds.as_tuple()[2]))),
    )
    lowest, highest = 1.0 / (float(seconds) + digit), 1.0 / max(float(seconds) - 0.5 * digit, 1e-9)
    if exact in (*USUAL_RATES, *BROADCAST_RATES) or highest / lowest < 1.0 + RATE_TOLERANCE:
        return exact, ()
    for rates in (USUAL_RATES, BROADCAST_RATES):
        within = [rate for rate in rates if lowest < rate <= highest]
        if within:
            rate = min(within, key=lambda rate: abs(rate - exact))
            return rate, (
                f"frame time {frame_time} s, cut to its digits, is taken as {rate:g} frames a "
                f"second rather than {exact:.5g}; source.rate or --rate overrules it",
            )
    return exact, ()


def doubted_rate(rate: float) -> tuple[float | None, str]:
    """Return the rate that is likely meant by an implausible one, and the doubt; "" for none.

    A frame time may be given in milliseconds, or the rate in its place.
    """
    if LEAST_PLAUSIBLE <= rate <= MOST_PLAUSIBLE:
        return None, ""
    time = 1.0 / rate
    meant, reading = None, "no usual rate"
    if time > 20.5 and any(
        abs(time - usual_rate) < 0.005 * usual_rate for usual_rate in USUAL_RATES
    ):
        meant, reading = time, f"{time:g} looks like the rate itself"
    elif LEAST_PLAUSIBLE <= 1000.0 / time <= USUAL_RATES[-1]:
        meant = rate_of_digits(f"{time / 1000.0:.6g}")[0]
        reading = f"{time:g} looks like milliseconds, {meant:g} frames a second"
    doubt = f"a frame every {time:g} s is implausible: {reading}; say source.rate or --rate"
    return meant, doubt


Vector = tuple[float, float, float]
ORIGIN: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class MotionFile:
    """One motion of one skeleton as a file holds it.

    source: the file's name, for messages. format: such as "BVH". skeleton: at rest with identity
    rotations. rotations (F, J, 4), translations (F, J, 3): local to the parent. rate: frames a
    second; None if neither file nor recipe states it. evidence: how the rate is known.
    metres_per_unit, up: as the file states them; None if it does not. added_offset: what
    source.root_offset = "add" adds to the root's path; zero for other formats than BVH. notes: on
    what the reader assumed and left out. curves: weights (F,) of blend shapes by name.
    """

    source: str
    format: str
    skeleton: Skeleton
    rotations: Rotations
    translations: Positions
    rate: float | None
    evidence: str
    metres_per_unit: float | None = None
    up: UpAxis | None = None
    added_offset: Vector = ORIGIN
    notes: tuple[str, ...] = ()
    curves: Mapping[str, Floats] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.rotations)

    @property
    def poses(self) -> int:
        """Return the number of frames times joints."""
        return len(self) * len(self.skeleton)

    def error(self, message: str) -> MotionFileError:
        """Return an error that names this file."""
        return MotionFileError(self.source, message)


@dataclass(frozen=True)
class ReadOptions:
    """Settings of a user for reading a file; None for those that are not given.

    rate: source.rate, frames a second. animation: name of one of several in the file. skeleton:
    the same, or the name of one of its joints. rate, metres_per_unit and up overrule the file.
    robot: whose motion the file holds, in formats of reference motions.
    """

    rate: float | None = None
    animation: str | None = None
    skeleton: str | None = None
    metres_per_unit: float | None = None
    up: UpAxis | None = None
    robot: RobotConventions | None = None


AS_STATED = ReadOptions()
"""Nothing told: a file is read by what it states."""


def choice(names: Sequence[str], requested: str) -> int | None:
    """Return the index of the one of some names that is wanted, by name or number from 1."""
    if names.count(requested) == 1:
        return names.index(requested)
    number = int(requested) if requested.isdecimal() else 0
    return number - 1 if 1 <= number <= len(names) else None


def expect_skeleton(source: str, tree: JointTree, options: ReadOptions) -> None:
    """Raise MotionFileError for another skeleton than the one that is wanted."""
    if options.skeleton not in (None, tree.label, *tree.names):
        raise MotionFileError(
            source, f"found the skeleton {tree.label!r}, expected {options.skeleton!r}"
        )


def curve_notes(curves: Mapping[str, Floats]) -> list[str]:
    """Return a note on weights of blend shapes, which are no motion of joints."""
    listed = ", ".join(list(curves)[:20])
    note = f"curves ({listed}) are no joints: only [curves] of a recipe reads them"
    return [note] if curves else []


LEAST_RATE = 10.0
"""Frames a second below which even keys are poses of an animator rather than frames."""
EVEN = 0.02
"""Largest deviation of the spacing of even keys, as a share of it."""
DROPPED = 0.1
"""Largest share of frames without a key that are told as dropped frames."""
WAY_OUT = "expected one in each frame, or a rate (source.rate, --rate) to sample the curves at"


class UnevenKeys(ValueError):
    """Keys of an animation that are no frames of a constant rate."""


def sample_times(keys: Floats, rate: float | None) -> tuple[Floats, float, str]:
    """Return the times (F,), s, of the frames between first and last key, rate and evidence.

    keys: (K,) times of all keys, s, increasing. rate: of source.rate; None takes the keys as
    frames. Raises UnevenKeys for fewer than two keys, and without a rate for keys that are uneven,
    that lack frames, or that are rarer than LEAST_RATE.
    """
    if len(keys) < 2 or not keys[-1] > keys[0]:
        raise UnevenKeys(f"found {len(keys)} key, a pose without motion, expected two or more")
    if rate is not None:
        count = int(np.floor((keys[-1] - keys[0]) * rate + EVEN)) + 1
        times = np.minimum(keys[0] + np.arange(count) / rate, keys[-1])
        return times, rate, "curves sampled at source.rate"
    _refuse_uneven(keys)
    rate = snapped_rate((keys[-1] - keys[0]) / (len(keys) - 1))
    if rate < LEAST_RATE:
        raise UnevenKeys(f"found {len(keys)} keys at {rate:g} a second, {WAY_OUT}")
    return keys, rate, f"keys every {1.0 / rate:g} s"


def _refuse_uneven(keys: Floats) -> None:
    spacing = np.diff(keys)
    step = float(np.median(spacing))
    if np.all(np.abs(spacing - step) <= EVEN * step):
        return
    frames = np.rint(spacing / step)
    lost = int(np.sum(frames - 1.0))
    is_regular = np.all(np.abs(spacing - frames * step) <= EVEN * step * np.maximum(frames, 1.0))
    if is_regular and frames.min() >= 1.0 and lost <= DROPPED * (len(keys) + lost):
        first = float(keys[np.argmax(frames > 1.0)])
        raise UnevenKeys(
            f"found {lost} dropped frames of {len(keys) + lost} at {1.0 / step:.6g} a second, the "
            f"first after {first:.6g} s, {WAY_OUT}"
        )
    raise UnevenKeys(
        f"found keys at uneven times, {spacing.min():.4g} to {spacing.max():.4g} s apart, {WAY_OUT}"
    )


RootOffset = Literal["replace", "add"]

SAME = 1e-4
"""Largest relative difference of two numbers that state the same unit or rate."""


def overrule(file: MotionFile, options: ReadOptions) -> MotionFile:
    """Return a file with what a user states of it, and a note on each that it states otherwise."""
    rate, unit, up = options.rate, options.metres_per_unit, options.up
    notes = list(file.notes)
    if rate and file.rate and abs(file.rate - rate) > SAME * rate:
        stated = f"{file.rate:.5g} frames a second ({file.evidence})"
        notes.append(f"states {stated}, overruled: read at {rate:g}")
    if unit and file.metres_per_unit and abs(file.metres_per_unit - unit) > SAME * unit:
        stated = f"a unit of {file.metres_per_unit:g} m"
        notes.append(f"states {stated}, overruled: read as {unit:g} m")
    if up and file.up and file.up != up:
        notes.append(f"states {file.up} as its up axis, overruled: read as {up}")
    return replace(
        file,
        rate=rate or file.rate,
        metres_per_unit=unit or file.metres_per_unit,
        up=up or file.up,
        notes=tuple(notes),
    )


def to_clip(
    file: MotionFile,
    *,
    metres_per_unit: float,
    up: UpAxis,
    root_offset: RootOffset = "replace",
) -> Clip:
    """Return the file's motion in metres with Y up.

    up="z" turns the basis of every offset and local rotation, (x, y, z) to (x, z, -y), so the rest
    pose stands upright. root_offset="add" adds the root's OFFSET to its path, as three.js does.
    Raises MotionFileError for a file without a rate, ValueError for an invalid argument.
    """
    if not (np.isfinite(metres_per_unit) and metres_per_unit > 0):
        raise ValueError(f"metres_per_unit {metres_per_unit}, expected a positive number")
    if up not in ("y", "z") or root_offset not in ("replace", "add"):
        raise ValueError(
            f"up {up!r}, root_offset {root_offset!r}; expected 'y' or 'z', 'replace' or 'add'"
        )
    rotations, translations = file.rotations, file.translations
    if root_offset == "add":
        translations = translations.copy()
        translations[:, 0] += np.array(file.added_offset)
    if up != "y":
        rotations = np.concatenate([rotations[..., :1], to_y_up(rotations[..., 1:], up)], axis=-1)
    lengths = metres_per_unit * to_y_up(translations, up)
    if file.rate is None:
        raise file.error(
            f"{file.format} files state no frame rate, expected source.rate, frames a second"
        )
    return Clip(_upright(file.skeleton, metres_per_unit, up), rotations, lengths, file.rate)


def to_y_up(vectors: Floats, up: UpAxis) -> Floats:
    """Return vectors (..., 3) with Y up; the last three components of a quaternion turn alike."""
    return vectors if up == "y" else vectors[..., [0, 2, 1]] * np.array([1.0, 1.0, -1.0])


def _upright(joints: Skeleton, metres_per_unit: float, up: UpAxis) -> Skeleton:
    """Return a skeleton in the unit and axes of a file in metres with Y up."""
    return Skeleton(
        joints.names,
        joints.parents,
        metres_per_unit * to_y_up(joints.offsets, up),
        joints.tip_joints,
        metres_per_unit * to_y_up(joints.tip_offsets, up),
    )
