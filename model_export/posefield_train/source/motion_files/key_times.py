"""Frame rate of animations whose curves have keys: even keys are frames, others need a rate."""

from dataclasses import dataclass

import numpy as np

from posefield.common.units import Floats
from posefield_train.source.motion_files.frame_rate import snapped_rate

LEAST_RATE = 10.0
"""Frames a second below which even keys are poses of an animator rather than frames."""
EVEN = 0.02
"""Largest deviation of the spacing of even keys, as a share of it."""
DROPPED = 0.1
"""Largest share of frames without a key that are told as dropped frames."""
WAY_OUT = "expected a key in every frame, or source.rate, at which the curves are sampled"


@dataclass(frozen=True)
class SampleTimes:
    """Times at which an animation is sampled. times: (F,), s. rate: frames a second."""

    times: Floats
    rate: float
    evidence: str


class UnevenKeys(ValueError):
    """Keys of an animation that are no frames of a constant rate."""


def sample_times(keys: Floats, rate: float | None) -> SampleTimes:
    """Return the times of the frames between the first key and the last.

    keys: (K,) times of all keys, s, increasing. rate: of source.rate; None takes the keys as
    frames. Raises UnevenKeys for fewer than two keys, and without a rate for keys that are uneven,
    that lack frames, or that are rarer than LEAST_RATE.
    """
    if len(keys) < 2 or not keys[-1] > keys[0]:
        raise UnevenKeys(f"found {len(keys)} key, a pose without motion, expected two or more")
    if rate is not None:
        count = int(np.floor((keys[-1] - keys[0]) * rate + EVEN)) + 1
        times = np.minimum(keys[0] + np.arange(count) / rate, keys[-1])
        return SampleTimes(times, rate, "curves sampled at source.rate")
    _refuse_uneven(keys)
    found = snapped_rate((keys[-1] - keys[0]) / (len(keys) - 1))
    if found < LEAST_RATE:
        raise UnevenKeys(f"found {len(keys)} keys at {found:g} a second, {WAY_OUT}")
    return SampleTimes(keys, found, f"keys every {1.0 / found:g} s")


def _refuse_uneven(keys: Floats) -> None:
    """Raise UnevenKeys for keys that are uneven or lack frames."""
    spacing = np.diff(keys)
    step = float(np.median(spacing))
    if np.all(np.abs(spacing - step) <= EVEN * step):
        return
    frames = np.rint(spacing / step)
    lost = int(np.sum(frames - 1.0))
    whole = np.all(np.abs(spacing - frames * step) <= EVEN * step * np.maximum(frames, 1.0))
    if whole and frames.min() >= 1.0 and lost <= DROPPED * (len(keys) + lost):
        first = float(keys[np.argmax(frames > 1.0)])
        raise UnevenKeys(
            f"found {lost} dropped frames of {len(keys) + lost} at {1.0 / step:.6g} a second, the "
            f"first after {first:.6g} s, {WAY_OUT}"
        )
    raise UnevenKeys(
        f"found keys at uneven times, {spacing.min():.4g} to {spacing.max():.4g} s apart, {WAY_OUT}"
    )
