"""Statistics of the contacts and swings of captured clips."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from posefield.common.units import Floats
from posefield.model_file.model_card import rounded
from posefield.motion import contact_detection
from posefield.motion.contact_detection import CLEARANCE, LONG_SWING, FootContact
from posefield_train.contacts.contact_labels import ClipContacts

USUAL_SWING, USUAL_CLEARANCE = 0.4, 0.05
"""Seconds and metres of a swing where no joint makes a whole one in any clip."""


@dataclass(frozen=True)
class _Swings:
    """Swings of one joint in all clips.

    durations: (M,), s. lifts: (M,), m. height: median height of the joint in its contacts, m; None
    for a joint without contacts.
    """

    durations: Floats
    lifts: Floats
    height: float | None


def contact_statistics(
    clips: Sequence[ClipContacts], joints: Sequence[int], cyclic: bool
) -> tuple[FootContact | None, ...]:
    """Return the statistics of each joint; None for one that has no contact in any clip.

    A joint without a whole swing between two contacts takes the swings of all others.
    """
    swings = [_swings(clips, place, cyclic) for place in range(len(joints))]
    durations = np.concatenate([own.durations for own in swings])
    lifts = np.concatenate([own.lifts for own in swings])
    if not len(durations):
        durations, lifts = np.array([USUAL_SWING]), np.array([USUAL_CLEARANCE])
    return tuple(
        None
        if own.height is None
        else _contact(
            joint,
            own.height,
            own.durations if len(own.durations) else durations,
            own.lifts if len(own.lifts) else lifts,
        )
        for joint, own in zip(joints, swings, strict=True)
    )


def without_swings(clips: Sequence[ClipContacts], place: int, cyclic: bool) -> bool:
    """Return True if the joint at a place in the labels makes no whole swing in any clip."""
    return len(_swings(clips, place, cyclic).durations) == 0


def _contact(joint: int, height: float, durations: Floats, lifts: Floats) -> FootContact:
    return FootContact(
        joint,
        rounded(height),
        rounded(np.median(durations)),
        rounded(np.percentile(durations, LONG_SWING)),
        rounded(np.percentile(lifts, CLEARANCE)),
    )


def _swings(clips: Sequence[ClipContacts], place: int, cyclic: bool) -> _Swings:
    durations, lifts, heights = [], [], []
    for clip in clips:
        contacts, height = clip.contacts[:, place], clip.heights[:, place]
        if cyclic:
            contacts, height = contacts[:-1], height[:-1]
        if not contacts.any():
            continue
        standing = float(np.median(height[contacts]))
        heights.append(standing)
        for run in contact_detection.runs(~contacts, cyclic):
            # A swing that the clip cuts has neither its duration nor its height.
            if cyclic or (run[0] > 0 and run[-1] < len(contacts) - 1):
                durations.append(len(run) / clip.rate)
                lifts.append(max(float(height[run].max()) - standing, 0.0))
    own = float(np.median(heights)) if heights else None
    return _Swings(np.array(durations), np.array(lifts), own)
