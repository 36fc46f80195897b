"""Noise-free motion at every control point, for measuring a model's errors."""

from collections.abc import Mapping, Sequence

import numpy as np

from posefield.common.units import Floats
from posefield.motion.clip import Clip, assemble
from posefield_train.sample import reaching, sample_controls
from posefield_train.sample.sample_controls import SampleControls, TimingWarp

ControlPoint = Mapping[str, float] | Sequence[float]
"""Controls by name, or four values in the order of controls.RANGES; turn in degrees."""


def poses(point: ControlPoint, phases: Floats) -> tuple[Floats, Floats, Floats]:
    """Return rotations (P, J, 4), root path (P, 3) and bone offsets (J, 3) at unwarped phases (P,).

    Phases run from 0 to 1, when the hand is at the target. Raises InvalidField for controls outside
    the body's limits, as every function here.
    """
    motion = reaching.reaching_motion(sample_controls.parse_controls(point), phases)
    return motion.rotations, motion.root_path, motion.figure.offsets


def target(point: ControlPoint) -> Floats:
    """Return the final `sample_limbs.palm_position` (3,), m, of the right hand."""
    return reaching.target(sample_controls.parse_controls(point))


def duration(point: ControlPoint) -> float:
    """Return the time from rest to the target, s."""
    return _duration(sample_controls.parse_controls(point))


def phases(point: ControlPoint, elapsed: Floats) -> Floats:
    """Return the phase at each elapsed fraction of the clip, strictly increasing from 0 to 1."""
    return warp(sample_controls.parse_controls(point)).phase(elapsed)


def truth_clip(point: ControlPoint, rate: float) -> Clip:
    """Return the clip at a frame rate, with its own duration and timing.

    It ends on the target: the duration is rounded to whole frames.
    """
    where = sample_controls.parse_controls(point)
    return synthesize(where, _duration(where), warp(where), rate)


def _duration(where: SampleControls) -> float:
    return sample_controls.fitts_duration(reaching.hand_travel(where))


def warp(where: SampleControls) -> TimingWarp:
    """Return the timing of controls: high targets start fast, turned ones late."""
    above = where.target_height - where.hip_height
    return TimingWarp(a=0.10 - 0.10 * where.uprightness, b=0.12 * above - 0.10 * where.azimuth**2)


def synthesize(where: SampleControls, seconds: float, pace: TimingWarp, rate: float) -> Clip:
    """Return the clip of a duration, s, rounded to whole frames, with a given timing."""
    steps = max(1, round(seconds * rate))
    motion = reaching.reaching_motion(where, pace.phase(np.arange(steps + 1) / steps))
    figure = motion.figure
    return assemble(figure, motion.rotations, motion.root_path, figure.offsets, rate)
