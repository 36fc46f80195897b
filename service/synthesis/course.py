"""The course of a clip: at which times its frames are, and where its root goes meanwhile."""

import math
from dataclasses import replace

import numpy as np

from service.motion.answer import PoseAnswer
from service.motion.conventions import Floats
from service.motion.errors import InvalidField
from service.synthesis import limits
from service.synthesis.question import ClipQuestion
from service.synthesis.walk import plane, stride
from service.synthesis.walk.stride import Strides

RATES = (1.0, 1000.0)
MOST_POSES = 10_000


def times(asked: ClipQuestion, duration: float) -> Floats:
    """Times (F,) of the frames asked for, s, of a clip that takes `duration`."""
    rate = _rate(asked)
    last = duration if asked.end is None else limits.number("end", asked.end)
    limits.within("end", last, 0.0, duration, "s")
    start = limits.number("start", asked.start)
    limits.within("start", start, 0.0, last, "s")
    # A millionth of a frame forgives the rounding of duration * rate.
    frames = math.floor((last - start) * rate + 1e-6) + 1
    _check_count(frames)
    return np.minimum(start + np.arange(frames) / rate, duration)


def loop_times(asked: ClipQuestion, duration: float) -> Floats:
    """Times (N,) of the frames of a cycle but the last, s, which is the first again."""
    if asked.start or asked.end is not None:
        field, value = ("start", asked.start) if asked.start else ("end", asked.end)
        raise InvalidField(field, f"{value!r} with loop, expected none: a loop is a whole cycle")
    steps = max(1, round(duration * _rate(asked)))
    _check_count(steps + 1)
    return np.arange(steps) * duration / steps


def in_place(answer: PoseAnswer, way: Strides) -> PoseAnswer:
    """The poses in the frame that goes along the way, which stays where the clip begins."""
    poses = stride.beside(way, answer.times / way.durations, answer.rotations, answer.root_position)
    root = plane.at_height(way.starts + poses.places, poses.heights)
    return replace(answer, rotations=poses.rotations, root_position=root)


def closed(answer: PoseAnswer, way: Strides | None) -> PoseAnswer:
    """The poses and the first of them again, carried along the way if there is one."""
    rotations, root = answer.rotations[:1], answer.root_position[:1]
    if way is not None:
        rotations = plane.turned(rotations, way.turns)
        root = root + plane.at_height(plane.arc(way.ways, way.turns), np.zeros(1))
    return replace(
        answer,
        times=np.append(answer.times, answer.trust.duration),
        rotations=np.concatenate([answer.rotations, rotations]),
        root_position=np.concatenate([answer.root_position, root]),
    )


def _rate(asked: ClipQuestion) -> float:
    rate = limits.number("fps", asked.fps)
    limits.within("fps", rate, *RATES, "frames a second")
    return rate


def _check_count(frames: int) -> None:
    if frames > MOST_POSES:
        raise InvalidField("fps", f"{frames} frames, expected at most {MOST_POSES}")
