"""Contacts of feet: from probabilities, or estimated from the motion where a model has none."""

from collections.abc import Sequence
from typing import Annotated

import numpy as np

from posefield.common.units import Booleans, Floats
from posefield.feet import stances
from posefield.feet.stances import FootPath, Interval
from posefield.locomotion import floor_plane
from posefield.motion.contacts import contact_detection
from posefield.motion.foot_contacts import CLEARANCE, LONG_SWING, FootContact

# A foot stands where its contact is more likely than not. Probabilities are rounded, so that two
# machines whose last digits differ plan the same steps.
STANDING, DECIMALS = 0.5, 6
# Swings of a motion in which no foot swings: median and longest duration, s.
DEFAULT_SWING, DEFAULT_LONGEST = 0.3, 0.5


def from_probabilities(
    paths: Sequence[FootPath], likely: Annotated[Floats, "frames feet"]
) -> list[list[Interval]]:
    """Return the contacts of each foot, whose probabilities are (F, K)."""
    down = np.round(likely, DECIMALS) > STANDING
    return [
        stances.tidy(own, path.rate, path.cycle is not None)
        for own, path in zip(down.T, paths, strict=True)
    ]


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
    paths: Sequence[FootPath],
    down: Sequence[Sequence[Interval]],
    known: Sequence[FootContact],
) -> list[float]:
    """Return how much higher each foot stands than captured feet do, by its median, m."""
    found = []
    for path, own, foot in zip(paths, down, known, strict=True):
        standing = path.heights[stances.mask(own, len(path))]
        found.append(float(np.median(standing)) - foot.height if len(standing) else 0.0)
    return found
