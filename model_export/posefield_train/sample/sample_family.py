"""Samples of the family, 92 or any number: their control points, and trials with noise."""

from collections.abc import Iterator
from dataclasses import astuple, dataclass, replace
from itertools import product

import numpy as np
from numpy.random import PCG64, Generator

from posefield.common.units import Floats
from posefield.motion import quat
from posefield.motion.clip import Clip
from posefield_train.sample import noise_free, sample_body, sample_controls
from posefield_train.sample.reach_timing import TimingWarp
from posefield_train.sample.sample_controls import STATURES, SampleControls

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
    """Return the controls of a trial, rounded as the table prints them."""
    low, high = sample_controls.limits("hip_height", stature, 0.0)
    band = (
        (high - sample_controls.STAND_RANGE, high)
        if standing
        else (low, low + 2 * sample_controls.SEAT_RANGE)
    )
    hip = _rounded(float(np.interp(spread[2], (0, 1), band)), low, high)
    places = []
    for name, part in zip(("turn", "target_height"), spread, strict=False):
        ends = sample_controls.limits(name, stature, hip)
        places.append(_rounded(float(np.interp(part, (0, 1), ends)), *ends))
    return SampleControls(stature, hip, *places)


def _rounded(value: float, low: float, high: float) -> float:
    """Return a value of a control with the table's four decimals, within its limits."""
    found, step = round(value, 4), 1e-4
    if found > high:
        return round(found - step, 4)
    return round(found + step, 4) if found < low else found


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
