"""Frame times of a clip, and the path of its root in place or in a loop."""

import math
from dataclasses import replace

import numpy as np

from posefield.common.errors import InvalidField
from posefield.common.units import Floats
from posefield.locomotion import floor_plane, stride
from posefield.locomotion.stride import Strides
from posefield.question import value_validation
from posefield.question.motion_question import ClipQuestion
from posefield.question.results import PoseAnswer

FPS_RANGE = (1.0, 1000.0)
MAX_POSES = 10_000


def time_window(asked: ClipQuestion, duration: float) -> tuple[float, float, float]:
    """Return frames a second, start (s) and end (s) of a clip of at most `duration` seconds.

    Raises InvalidField for values out of range, and for a loop with a start or an end.
    """
    rate = value_validation.check_number("fps", asked.fps)
    value_validation.check_range("fps", rate, *FPS_RANGE, "frames a second")
    last = duration
    if asked.end is not None:
        end = value_validation.check_number("end", asked.end)
        last = value_validation.check_rounded_range("end", end, 0.0, duration, "s")
    start = value_validation.check_number("start", asked.start)
    start = value_validation.check_rounded_range("start", start, 0.0, last, "s")
    if asked.loop and (start > 0.0 or asked.end is not None):
        field, value = ("start", start) if start > 0.0 else ("end", last)
        raise InvalidField(field, f"{value:g} s with loop, expected none: a loop is a whole cycle")
    return rate, start, last


def sample_times(asked: ClipQuestion, duration: float, most: int = MAX_POSES) -> Floats:
    """Return the times (F,), s, of the requested frames of a clip that lasts `duration` seconds.

    A loop's times lack the last frame, which equals the first. Raises InvalidField for more frames
    than `most`.
    """
    rate, start, last = time_window(asked, duration)
    if asked.loop:
        steps = max(1, round(duration * rate))
        _check_count(steps + 1, most)
        return np.arange(steps) * duration / steps
    # Tolerance of a millionth of a frame for the rounding of duration * rate.
    frames = math.floor((last - start) * rate + 1e-6) + 1
    _check_count(frames, most)
    return np.minimum(start + np.arange(frames) / rate, duration)


def remove_travel(answer: PoseAnswer[np.float64], way: Strides) -> PoseAnswer[np.float64]:
    """Return the poses in the frame that travels along the way, placed at the start of the clip."""
    poses = stride.relative_poses(
        way, answer.times / way.durations, answer.rotations, answer.root_position
    )
    root = floor_plane.at_height(way.starts + poses.places, poses.heights)
    return replace(answer, rotations=poses.rotations, root_position=root)


def close_loop(answer: PoseAnswer[np.float64], way: Strides | None) -> PoseAnswer[np.float64]:
    """Return the poses with the first one appended, moved by the cycle's travel if any."""
    rotations, root = answer.rotations[:1], answer.root_position[:1]
    if way is not None:
        rotations = floor_plane.turn_roots(rotations, way.turns)
        root = root + floor_plane.at_height(
            floor_plane.arc_displacement(way.travels, way.turns), np.zeros(1)
        )
    curves = answer.curves
    return replace(
        answer,
        times=np.append(answer.times, answer.trust.duration),
        rotations=np.concatenate([answer.rotations, rotations]),
        root_position=np.concatenate([answer.root_position, root]),
        curves=None if curves is None else np.concatenate([curves, curves[:1]]),
    )


def join(first: PoseAnswer[np.float64], last: PoseAnswer[np.float64]) -> PoseAnswer[np.float64]:
    """Return the poses of one motion at the times of two answers, with the trust of the first."""
    curves = None if first.curves is None else np.concatenate([first.curves, last.curves])
    return replace(
        first,
        times=np.append(first.times, last.times),
        rotations=np.concatenate([first.rotations, last.rotations]),
        root_position=np.concatenate([first.root_position, last.root_position]),
        curves=curves,
    )


def part(answer: PoseAnswer[np.float64], frames: slice) -> PoseAnswer[np.float64]:
    """Return some of the poses of an answer."""
    return replace(
        answer,
        times=answer.times[frames],
        rotations=answer.rotations[frames],
        root_position=answer.root_position[frames],
        curves=None if answer.curves is None else answer.curves[frames],
    )


def _check_count(frames: int, most: int) -> None:
    if frames > most:
        raise InvalidField("fps", f"{frames} frames, expected at most {most}")
