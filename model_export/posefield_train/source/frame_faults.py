"""Faults of the frames of a recording: a rest pose at first, frames twice, joints that leap."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from posefield.common.units import Floats, Indices, Positions

MEDIAN_SPAN = 0.035
"""Half the time over which the median step around a frame is taken, s. A leap, or a leap and its
return, does not change the median; the start of a motion does."""
LEAP_FACTOR, FARTHER = 8.0, 0.03
"""Multiple of the median step, and way beyond it, m, from which on a step is a leap."""
AT_REST = 0.03
"""Largest difference of the distances between joints at which a pose is the rest pose, m."""
LEAVES_REST = 0.1
"""Least difference from the next frame at which a rest pose is no part of the motion, m."""
REPEATED = 1e-7
"""Largest step of any joint between a frame and its repetition, m."""
MOVING = 0.2
"""Least speed of the fastest joint before and after repeated frames, m/s: a held pose is none."""
LONGEST_REPETITION = 0.5
"""Duration of repeated frames from which on they are a pose that is held, s."""


@dataclass(frozen=True)
class Leap:
    """Step from a frame to the next that a body cannot do.

    joint: index of that which goes farthest. distance: its way, m. whole: whether more than half
    of the joints leap.
    """

    frame: int
    joint: int
    distance: float
    whole: bool


@dataclass(frozen=True)
class FrameFaults:
    """Faults of the frames of a recording.

    from_rest: difference of the first frame, a rest pose that the motion does not begin with, from
    the next, m; 0 where the motion begins with the first frame. repeated: frames that repeat the
    frame before while the body moves. leaps: in order, without that from a first frame at rest.
    """

    from_rest: float
    repeated: tuple[int, ...]
    leaps: tuple[Leap, ...]

    @property
    def rests_first(self) -> bool:
        """Return whether the first frame is left out."""
        return self.from_rest > 0.0


NO_FAULTS = FrameFaults(0.0, (), ())


def find_faults(positions: Positions, rate: float, rest: Floats) -> FrameFaults:
    """Return the faults of a motion.

    positions: of joints (F, J, 3), m. rate: frames a second. rest: positions (J, 3) at rest, m.
    """
    if len(positions) < 3:
        return NO_FAULTS
    steps = np.linalg.norm(np.diff(positions, axis=0), axis=-1)
    leaps = find_leaps(steps, rate)
    from_rest = _way_from_rest(positions, rest)
    motion_leaps = tuple(leap for leap in leaps if leap.frame > 0 or not from_rest)
    return FrameFaults(from_rest, _repeated(steps, rate), motion_leaps)


def find_leaps(steps: Floats, rate: float) -> list[Leap]:
    """Return the leaps between frames whose joints are steps (F - 1, J), m, apart."""
    frames, joints, _ = leaping_steps(steps, rate)
    leaps = []
    for frame in np.unique(frames).tolist():
        leaping = joints[frames == frame]
        joint = int(leaping[np.argmax(steps[frame, leaping])])
        is_whole = len(leaping) > 0.5 * steps.shape[1]
        leaps.append(Leap(frame, joint, float(steps[frame, joint]), is_whole))
    return leaps


def leaping_steps(steps: Floats, rate: float) -> tuple[Indices, Indices, Floats]:
    """Return the leaps among steps (F - 1, J), m, in the order of their frames.

    Frames, joints and usual steps, m, of each (N,).
    """
    reach = max(2, round(MEDIAN_SPAN * rate))
    # Few steps are long enough, so that the median is taken around these alone.
    frames, joints = np.nonzero(steps > FARTHER)
    around = np.clip(frames[:, None] + np.arange(-reach, reach + 1), 0, len(steps) - 1)
    medians = np.median(steps[around, joints[:, None]], axis=1)
    paces = np.maximum(medians, FARTHER / LEAP_FACTOR / 4)
    lengths = steps[frames, joints]
    is_leap = (lengths - paces > FARTHER) & (lengths > LEAP_FACTOR * paces)
    return frames[is_leap], joints[is_leap], paces[is_leap]


def _way_from_rest(positions: Positions, rest: Floats) -> float:
    """Return how far the second pose (of F, J, 3) is from the first if that alone is at rest."""
    first, following, after = (_distances(pose) for pose in (*positions[:2], positions[2]))
    leaves = float(np.abs(following - first).max())
    goes_on = float(np.abs(after - following).max())
    is_rest = float(np.abs(first - _distances(rest)).max()) < AT_REST
    return leaves if is_rest and leaves > max(LEAVES_REST, LEAP_FACTOR * goes_on) else 0.0


def _distances(pose: Floats) -> Floats:
    """Return the distances (J, J) between joints at (J, 3), which no placement changes."""
    return np.asarray(np.linalg.norm(pose[:, None] - pose, axis=-1))


def _repeated(steps: Floats, rate: float) -> tuple[int, ...]:
    """Return the frames that repeat the frame before, between steps (F - 1, J) of a motion."""
    farthest = steps.max(axis=1)
    same = farthest < REPEATED
    edges = np.flatnonzero(np.diff(np.concatenate([[False], same, [False]]).astype(int)))
    repeated: list[int] = []
    for first, end in edges.reshape(-1, 2).tolist():
        if first == 0 or end == len(same) or end - first > LONGEST_REPETITION * rate:
            continue
        if min(farthest[first - 1], farthest[end]) * rate > MOVING:
            repeated += range(first + 1, end + 1)
    return tuple(repeated)


def describe(
    faults: FrameFaults, joints: Sequence[str], rate: float, left_out: bool = False
) -> list[str]:
    """Return a sentence for each kind of fault.

    joints: their names or roles. left_out: whether frames at rest and clips across leaps were.
    """
    sentences = []
    if faults.rests_first:
        sentences.append(
            f"frame 0 is the rest pose, {faults.from_rest:.2f} m from frame 1"
            f"{', and was left out' if left_out else ''}"
        )
    if faults.repeated:
        first = faults.repeated[0] / rate
        sentences.append(
            f"{_counted(len(faults.repeated), 'frame')} repeated while the body moves, the first "
            f"at {first:.2f} s: dropped frames"
        )
    if faults.leaps:
        leap = max(faults.leaps, key=lambda fault: fault.distance)
        what = "the whole body" if leap.whole else joints[leap.joint]
        sentences.append(
            f"{_counted(len(faults.leaps), 'leap')}, {what} by {leap.distance:.2f} m between "
            f"frames {leap.frame} and {leap.frame + 1}"
            f"{': clips across leaps were left out' if left_out else ''}"
        )
    return sentences


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"
