"""Phase of the cycle along a walk, tied to the distance, and the steps at its standing ends."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import Frames
from posefield.common.units import Floats
from posefield.performance.walks import standing_pose, standing_steps
from posefield.performance.walks.standing_pose import StandingPose
from posefield.performance.walks.standing_steps import MOST_BESIDE, StandingEnds
from posefield.performance.walks.walk_request import WalkNote
from posefield.performance.walks.walker import Walker

MAX_SCALING, SHORT_SCALING = 0.06, 0.15
"""Largest changes of the stride length, as shares, with which a walk stops at a phase: of a walk
that is long enough, and of a shorter one."""
SCALED_CYCLES = 2.0
"""Smallest number of cycles before a stop over which strides are scaled, of those there are."""
SYNTHESISED = "synthesised"
"""First word of the codes of notes about motion that no capture shows."""

Phases = Annotated[Floats, "phases"]


@dataclass(frozen=True)
class PhasePlan:
    """Phases of a walk (F,), without wrapping, the steps at its standing ends, and notes.

    standing: None for a walk without such steps.
    """

    phases: Frames
    standing: StandingEnds | None
    notes: tuple[WalkNote, ...]


def plan_phases(
    walker: Walker, distances: Frames, ways: Frames, phase: float, ends: tuple[str, str]
) -> PhasePlan:
    """Return the phases of a walk and the steps at its standing ends.

    distances: (F,), m. ways: lengths of the stride (F,), m. phase: at the first frame. ends:
    whether the walk begins and ends "standing". A walk that is too short for an opening or a
    closing step begins or ends in double support.
    """
    steps = np.diff(distances) * 0.5 * (1.0 / ways[1:] + 1.0 / ways[:-1])
    gone = np.pad(np.cumsum(steps), (1, 0))
    begin, stop = (end == "standing" for end in ends)
    if not (begin or stop):
        return PhasePlan(phase + gone, None, ())
    pose = standing_pose.find_standing_pose(walker)
    wanted = begin and pose is not None, stop and pose is not None
    # Without room for a step, the phases are planned once more for a walk without it.
    for _ in range(2 if any(wanted) else 1):
        quiet = [pose.phases if pose and own else walker.double_supports for own in wanted]
        phases, left = _tied(gone, phase, (quiet[0] if begin else None, quiet[1] if stop else None))
        opening, closing = _frames(pose, phases, wanted)
        if (opening > 0, closing > 0) == wanted:
            break
        wanted = opening > 0, closing > 0
    standing = StandingEnds(pose, opening, closing) if pose and any(wanted) else None
    notes = [*_standing_notes(ends, wanted), *_left_notes(left, float(ways[-1]), wanted[1])]
    return PhasePlan(phases, standing, tuple(notes))


def _tied(
    gone: Frames, phase: float, quiet: tuple[Phases | None, Phases | None]
) -> tuple[Frames, float]:
    """Return phases (F,) from those gone since the first frame, and what is left at the end.

    quiet: phases at which the walk begins and ends standing; None for an end in motion.
    """
    begin, stop = quiet
    first = phase if begin is None else phase + _to_nearest(phase, begin)
    phases = first + gone
    if stop is None:
        return phases, 0.0
    return _scaled(phases, _to_nearest(float(phases[-1]), stop))


def _frames(
    pose: StandingPose | None, phases: Frames, wanted: tuple[bool, bool]
) -> tuple[int, int]:
    """Return the frames of the opening and the closing step; 0 for one without room."""
    if pose is None:
        return 0, 0
    closing = standing_steps.closing_frames(pose, phases) if wanted[1] else 0
    opening = standing_steps.opening_frames(pose, phases) if wanted[0] else 0
    return (opening if opening + closing <= len(phases) else 0), closing


def _to_nearest(phase: float, quiet: Phases) -> float:
    """Return the signed difference from a phase to the nearest quiet one, in cycles."""
    if not len(quiet):
        return 0.0
    gaps = (quiet - phase + 0.5) % 1.0 - 0.5
    return float(gaps[np.argmin(np.abs(gaps))])


def _scaled(phases: Frames, missing: float) -> tuple[Frames, float]:
    """Return phases whose last cycles advance faster or slower by a share, and what is left.

    The share has the form of a half sine over those cycles, so that it begins and ends with zero.
    """
    # The mean of a half sine is 2 / pi of its largest value, which is the limit.
    mean = MAX_SCALING * 2.0 / np.pi
    cycles = min(max(SCALED_CYCLES, abs(missing) / mean), float(phases[-1] - phases[0]))
    if cycles <= 0.0:
        return phases, missing
    most = SHORT_SCALING * 2.0 / np.pi * cycles
    done = float(np.clip(missing, -most, most))
    part = np.clip((phases - phases[-1]) / cycles + 1.0, 0.0, 1.0)
    return phases + done * 0.5 * (1.0 - np.cos(np.pi * part)), missing - done


def _standing_notes(ends: tuple[str, str], steps: tuple[bool, bool]) -> Iterator[WalkNote]:
    names = ("start", "begins", "an opening step"), ("stop", "ends", "a closing step")
    for (field, word, step), end, made in zip(names, ends, steps, strict=True):
        if end != "standing":
            continue
        way = f"with {step}" if made else "by slowing down its slowest stride"
        message = f"the walk {word} standing {way}, which is synthesised: none was captured"
        yield WalkNote(f"{SYNTHESISED}-{field}", field, message)
        if not made:
            message = f"there is no room for {step}: the walk {word} with one foot ahead"
            yield WalkNote("feet-apart", field, message)


def _left_notes(left: float, way: float, closed: bool) -> Iterator[WalkNote]:
    """Yield a note on a stop that strides could not be scaled for. way: of a stride, m."""
    if closed and 2.0 * (abs(left) * way - MOST_BESIDE) > MOST_BESIDE:
        apart = 200.0 * (abs(left) * way - MOST_BESIDE)
        said = f"bring the feet beside each other: one stands {apart:.0f} cm ahead"
    elif not closed and abs(left) > 0.01:
        said = f"stop in double support: {100.0 * abs(left):.0f} % of a cycle are left"
    else:
        return
    message = f"the walk is too short to {said}; a path longer by a quarter of a stride mends it"
    yield WalkNote("stops-in-mid-stride", "stop", message)
