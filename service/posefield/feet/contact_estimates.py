"""Contacts of feet: from probabilities, or estimated from the motion where a model has none."""

from collections.abc import Sequence
from typing import Annotated

import numpy as np

from posefield.common.frame_groups import FrameRows
from posefield.common.units import Booleans, Floats
from posefield.feet import stance_rows, stances
from posefield.feet.stance_rows import Runs
from posefield.feet.stances import FootPath, Interval
from posefield.locomotion import floor_plane
from posefield.motion.contacts import contact_detection
from posefield.motion.foot_contacts import CLEARANCE, LONG_SWING, FootContact

# A foot stands where its contact is more likely than not. Probabilities are rounded, so that two
# machines whose last digits differ plan the same steps.
STANDING, DECIMALS = 0.5, 6
# Swings of a motion in which no foot swings: median and longest duration, s.
DEFAULT_SWING, DEFAULT_LONGEST = 0.3, 0.5


def from_probabilities(likely: Annotated[Floats, "frames"], rows: FrameRows) -> Runs:
    """Return the contacts of feet, whose probabilities are (N,)."""
    return stance_rows.tidy(np.round(likely, DECIMALS) > STANDING, rows)


def from_motion(paths: Sequence[FootPath]) -> list[list[Interval]]:
    """Return the contacts of each foot, detected by its speed and height."""
    return [stances.runs(detect(path), path.cycle is not None) for path in paths]


def detect(path: FootPath) -> Annotated[Booleans, "frames"]:
    """Return whether the foot is in contact at each frame (F,)."""
    if path.cycle is None:
        return contact_detection.detect_contacts(path.positions, path.rate, False)
    after = floor_plane.at_height(path.places([len(path)]), path.heights[:1])
    whole = np.concatenate([path.positions, after])
    return contact_detection.detect_contacts(whole, path.rate, True)[:-1]


def statistics(joint: int, path: FootPath, found: Sequence[Interval]) -> FootContact:
    """Return the statistics of a foot's contacts in one motion."""
    down, cyclic = stances.mask(found, len(path)), path.cycle is not None
    heights = path.heights
    height = float(np.median(heights[down])) if down.any() else float(heights.min())
    swings = [
        swing
        for swing in stances.runs(~down, cyclic)
        if cyclic or (swing.begin > 0 and swing.end < len(path))
    ]
    if not swings:
        return FootContact(joint, height, DEFAULT_SWING, DEFAULT_LONGEST, 0.0)
    seconds = [len(swing) / path.rate for swing in swings]
    lifts = [heights[np.arange(own.begin, own.end) % len(path)].max() - height for own in swings]
    return FootContact(
        joint,
        height,
        float(np.median(seconds)),
        float(np.percentile(seconds, LONG_SWING)),
        max(0.0, float(np.percentile(lifts, CLEARANCE))),
    )


def heights_above(
    heights: Annotated[Floats, "frames"],
    found: Runs,
    usual: Annotated[Floats, "rows"],
    rows: FrameRows,
) -> Annotated[Floats, "rows"]:
    """Return how much higher feet stand than captured ones do (R,), by their medians, m.

    heights: (N,), m. usual: heights (R,), m, of captured feet.
    """
    run, frames = found.frames()
    row = found.rows[run]
    standing = heights[rows.flat(row, frames)]
    standing = standing[np.lexsort((standing, row))]
    counts = np.bincount(row, minlength=len(usual))
    above = np.zeros(len(usual))
    stands = counts > 0
    first, count = (np.cumsum(counts) - counts)[stands], counts[stands]
    middle = 0.5 * (standing[first + (count - 1) // 2] + standing[first + count // 2])
    above[stands] = middle - usual[stands]
    return above
