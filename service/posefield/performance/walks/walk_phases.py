"""Phase of the cycle along a walk, tied to the distance."""

from collections.abc import Iterator
from typing import Annotated

import numpy as np

from posefield.common.units import Floats

MAX_SCALING = 0.06
"""Largest change of the stride length, as a share, with which a walk stops in double support."""
SCALED_CYCLES = 2.0
"""Smallest number of cycles before a stop over which strides are scaled, of those there are."""

Note = tuple[str, str, str]
"""Code, field of the request and sentence."""


def tied_to_distance(
    distances: Annotated[Floats, "frames"],
    ways: Annotated[Floats, "frames"],
    phase: float,
    quiet: Annotated[Floats, "phases"],
    ends: tuple[str, str],
) -> tuple[Annotated[Floats, "frames"], list[Note]]:
    """Return the phases (F,), without wrapping, and notes.

    distances: (F,), m. ways: lengths of the stride (F,), m. phase: at the first frame. quiet:
    phases in double support. ends: whether the walk begins and ends "standing".
    """
    steps = np.diff(distances) * 0.5 * (1.0 / ways[1:] + 1.0 / ways[:-1])
    gone = np.pad(np.cumsum(steps), (1, 0))
    begin, stop = (end == "standing" and len(quiet) > 0 for end in ends)
    first = phase + _to_nearest(phase, quiet) if begin else phase
    phases = first + gone
    notes = list(_standing_notes(ends))
    if stop:
        missing = _to_nearest(float(phases[-1]), quiet)
        phases, left = _scaled(phases, missing)
        notes += list(_left_note(left))
    return phases, notes


def _to_nearest(phase: float, quiet: Floats) -> float:
    """Return the signed difference from a phase to the nearest quiet one, in cycles."""
    gaps = (quiet - phase + 0.5) % 1.0 - 0.5
    return float(gaps[np.argmin(np.abs(gaps))])


def _scaled(
    phases: Annotated[Floats, "frames"], missing: float
) -> tuple[Annotated[Floats, "frames"], float]:
    """Return phases whose last cycles advance faster or slower by a share, and what is left.

    The share has the form of a half sine over those cycles, so that it begins and ends with zero.
    """
    # The mean of a half sine is 2 / pi of its largest value, which is the limit.
    mean = MAX_SCALING * 2.0 / np.pi
    cycles = min(max(SCALED_CYCLES, abs(missing) / mean), float(phases[-1] - phases[0]))
    if cycles <= 0.0:
        return phases, missing
    most = mean * cycles
    done = float(np.clip(missing, -most, most))
    part = np.clip((phases - phases[-1]) / cycles + 1.0, 0.0, 1.0)
    return phases + done * 0.5 * (1.0 - np.cos(np.pi * part)), missing - done


def _standing_notes(ends: tuple[str, str]) -> Iterator[Note]:
    for name, end, word in zip(("start", "stop"), ends, ("begins", "ends"), strict=True):
        if end == "standing":
            yield (
                f"synthesised-{name}",
                name,
                f"the walk {word} standing by slowing down its slowest stride, which was not "
                "captured",
            )


def _left_note(left: float) -> Iterator[Note]:
    if abs(left) > 0.01:
        yield (
            "stops-in-mid-stride",
            "stop",
            f"the walk is too short to stop in double support: {100.0 * abs(left):.0f} % of a "
            "cycle are left; a path longer by a quarter of a stride mends it",
        )
