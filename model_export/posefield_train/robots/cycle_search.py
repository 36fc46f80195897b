"""Cycles of reference motions that repeat, which most files do not state."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.units import Floats
from posefield.robots.robot import HingeAngles, Robot
from posefield.robots.robot_motion import RobotMotion

LEFT, BACK = 0.5, 0.3
"""Differences of poses, as shares of that of unlike poses, beyond which a motion has left a pose,
and below which it is back."""
LONGEST, LONGEST_SHARE = 5.0, 0.6
"""Longest cycle, s, and as a share of the file, so that most of the next one can be compared."""
CLOSER, LEAST_GAP = 2.0, np.radians(0.1)
"""Two cycles are cut where they close so many times better than one, which stays so far open."""
CLOSED, MOVING = 0.3, 0.1
"""Shares of the mean step: of the last pose from the first of one cycle, and of the steps there."""
ROUNDS = 4
"""Rounds in which the motions of a call are brought into one phase."""


@dataclass(frozen=True)
class Cycle:
    """Frames of a motion that repeat.

    first, last: frames of one pose, `count` cycles apart. seconds: of one cycle. gap: difference of
    the joints' angles at both frames and beside them, root mean square, rad.
    """

    first: int
    last: int
    count: int
    seconds: float
    gap: float


def find(motions: Sequence[RobotMotion], robot: Robot | None) -> list[Cycle | None]:
    """Return a cycle of each motion, the one that closes best; None where a motion does not repeat.

    All begin in one phase: that of the first frame of the first motion that repeats. It is told by
    the heights of the robot's soles: joints swing the other way in gaits the other way.
    """
    periods = [_period(motion) for motion in motions]
    rows = [row for row, frames in enumerate(periods) if frames]
    signals = [_signals(motions[row], robot) for row in rows]
    starts = _starts(signals, [periods[row] for row in rows])
    single, double = (
        [
            _cut(motions[row], periods[row], start, count)
            for row, start in zip(rows, starts, strict=True)
        ]
        for count in (1, 2)
    )
    gap, pair = (np.median([cut.gap for cut in cuts if cut] or [0.0]) for cuts in (single, double))
    is_double = all(double) and gap > max(LEAST_GAP, CLOSER * pair)
    cycles = dict(zip(rows, double if is_double else single, strict=True))
    return [cycles.get(row) or _whole(motion) for row, motion in enumerate(motions)]


def _whole(motion: RobotMotion) -> Cycle | None:
    """Return a motion that ends in its first pose, moving, as one cycle; None for others."""
    angles = motion.angles
    steps = _differences(angles[1:], angles[:-1])
    gap, mean = float(_differences(angles[:1], angles[-1:])[0]), float(steps.mean())
    moves = min(steps[0], steps[-1]) > MOVING * mean
    closed = moves and gap <= CLOSED * mean
    return Cycle(0, len(motion) - 1, 1, motion.duration, gap) if closed else None


def _period(motion: RobotMotion) -> float:
    """Return the frames, not whole, after which a motion repeats; 0 where it does not."""
    angles = motion.angles
    unlike = np.sqrt(2.0 * np.square(angles - angles.mean(axis=0)).mean())
    lags = range(1, int(min(LONGEST * motion.rate, LONGEST_SHARE * len(angles))))
    # Of most frames: a robot may start and stop.
    gaps = np.array([np.median(_differences(angles[lag:], angles[:-lag])) for lag in lags])
    outside = np.flatnonzero(gaps > LEFT * unlike)
    inside = np.flatnonzero(gaps < BACK * unlike)
    inside = inside[inside > outside[0]] if len(outside) else inside[:0]
    if not len(inside):
        return 0.0
    run = inside[: int(np.argmax(np.append(np.diff(inside), 2) > 1)) + 1]
    best, frames, count = int(run[np.argmin(gaps[run])]), 0.0, 0
    # The return after many cycles tells the frames of one more exactly.
    while 0 < best < len(gaps) - 1 and gaps[best] < BACK * unlike:
        before, middle, after = np.square(gaps[best - 1 : best + 2])
        if middle > min(before, after) or before == after == middle:
            break
        count += 1
        frames = (best + 1 + 0.5 * (before - after) / (before - 2.0 * middle + after)) / count
        near = round((count + 1) * frames) - 1
        if near + 2 > len(gaps):
            break
        best = near - 1 + int(np.argmin(gaps[near - 1 : near + 2]))
    return float(frames)


def _differences(angles: HingeAngles, reference: HingeAngles) -> Floats:
    return np.asarray(np.sqrt(np.square(angles - reference).mean(axis=1)))


def _signals(motion: RobotMotion, robot: Robot | None) -> Annotated[Floats, "frames signals"]:
    signals = motion.angles
    if robot and robot.feet:
        soles = robot.foot_points(*motion.body_poses(robot))
        signals = np.stack([points[..., 2].min(axis=1) for points in soles], axis=-1)
    return (signals - signals.mean(axis=0)) * np.hanning(len(signals))[:, None]


def _starts(signals: Sequence[Floats], periods: Sequence[float]) -> Floats:
    """Return the frame (M,), not whole, of each motion's first cycle at which all are in one phase.

    It is told by the first harmonic of all signals, in the median over the motions.
    """
    if not signals:
        return np.empty(0)
    waves = np.array(
        [
            np.exp(-2j * np.pi * np.arange(len(signal)) / frames) @ signal
            for signal, frames in zip(signals, periods, strict=True)
        ]
    )
    typical, phases = waves[0], np.zeros(len(waves))
    for _ in range(ROUNDS):
        phases = np.angle(waves @ typical.conj())
        shifted = waves * np.exp(-1j * phases)[:, None]
        typical = np.median(shifted.real, axis=0) + 1j * np.median(shifted.imag, axis=0)
    phases = (phases - phases[0]) / (2.0 * np.pi)
    starts = (-phases * np.array(periods)) % np.array(periods)
    # Within a frame the phase is free: where rounding moves the starts least.
    return starts - np.angle(np.exp(2j * np.pi * starts).sum()) / (2.0 * np.pi)


def _cut(motion: RobotMotion, frames: float, start: float, count: int) -> Cycle | None:
    """Return the cycles of a motion that close best; None where the file ends before."""
    length, angles = round(count * frames), motion.angles
    differences = _differences(angles[length:], angles[:-length])
    gaps = np.sqrt(np.convolve(np.square(differences), np.full(3, 1.0 / 3.0), "valid"))
    starts = np.arange(start, len(gaps) + 1.0, frames)
    starts = starts[(starts > 0.5) & (starts < len(gaps) + 0.5)]
    if not len(starts):
        return None
    # A frame that is not the one of the phase is off by its share of a step.
    firsts = np.round(starts).astype(int)
    off_phase = np.abs(starts - firsts) * _differences(angles[1:], angles[:-1]).mean()
    first = int(firsts[np.argmin(gaps[firsts - 1] + off_phase)])
    return Cycle(first, first + length, count, frames / motion.rate, float(gaps[first - 1]))
