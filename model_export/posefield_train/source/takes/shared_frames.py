"""Detection of clips that share frames, mirror each other, or continue each other."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from posefield.common.array_shapes import Positions
from posefield.common.units import Floats
from posefield_train.source.takes import frame_features
from posefield_train.source.takes.frame_features import SAME

FEWEST = 3
"""Fewest shared frames: a rest pose alone may be the same in many clips."""
MOVED = 0.02
"""Way of a joint within the shared frames, m, without which they show nothing but a held pose."""
FEWEST_JOINTS = 4
"""Fewest joints for which the boundary of two clips tells that one continues the other."""
LEAST_STEP = 0.5 * SAME
"""Least root mean square step before the boundary of two clips, m: a held pose tells nothing."""
STEADY, FOLLOWS = 0.5, 0.25
"""Largest differences, as shares of that step, of the step after the boundary, and of the next
frame from the one that the step leads to."""
FLOOR = np.array([0, 2])

Motions = Sequence[Annotated[Floats, "_ joints 3"]]
"""Joint positions (F, J, 3) of clips, m; each clip has its own number of frames."""
Relation = Literal["shares frames with", "mirrors", "continues"]


@dataclass(frozen=True)
class ClipPair:
    """Two clips of one recording. first, second: their indices; the second relates to the first."""

    first: int
    second: int
    relation: Relation


def find_pairs(motions: Motions, swapped: tuple[int, ...]) -> list[ClipPair]:
    """Return the pairs of clips that come from the same recording.

    motions: joint positions (F, J, 3), m, as captured. swapped: index of each joint's counterpart
    on the other side.
    """
    return [*_overlaps(motions, list(swapped)), *_continuations(motions)]


def _overlaps(motions: Motions, swapped: list[int]) -> Iterator[ClipPair]:
    features = [frame_features.frame_features(motion) for motion in motions]
    index = frame_features.index_frames(features)
    # Views: of thousands of clips a second copy is hundreds of megabytes.
    features = np.split(index.features, np.cumsum(index.counts)[:-1])
    joints = len(swapped)
    other = np.array([*swapped, *(joints + joint for joint in swapped)])
    for second, motion in enumerate(motions):
        ways: dict[Relation, tuple[Floats, Floats]]
        ways = {"shares frames with": (features[second], motion)}
        if swapped != list(range(joints)):
            ways["mirrors"] = features[second][:, other], _mirrored(motion, swapped)
        for relation, (own, moved) in ways.items():
            known = {second}
            for first, start in index.like(own):
                # Two clips that begin together are found from both.
                if first in known or (start == 0 and first > second):
                    continue
                if _same_frames(motions[first][start:], moved):
                    known.add(first)
                    yield ClipPair(first, second, relation)


def _mirrored(motion: Positions, swapped: list[int]) -> Positions:
    return np.asarray(motion[:, swapped] * np.array([-1.0, 1.0, 1.0]))


def _same_frames(
    first: Annotated[Floats, "_ joints 3"], second: Annotated[Floats, "_ joints 3"]
) -> bool:
    """Return whether all frames that both have are the same but for one place and heading."""
    count = min(len(first), len(second))
    if count < FEWEST:
        return False
    a, b = first[:count], second[:count]
    if float(np.linalg.norm(np.ptp(a, axis=0), axis=-1).max()) < MOVED:
        return False
    a, b = a - a.mean(axis=(0, 1)), b - b.mean(axis=(0, 1))
    # The turn about the vertical that brings b nearest to a.
    x, z = FLOOR
    sine = float(np.sum(a[..., x] * b[..., z] - a[..., z] * b[..., x]))
    cosine = float(np.sum(a[..., FLOOR] * b[..., FLOOR]))
    angle = np.arctan2(sine, cosine)
    turned = b.copy()
    turned[..., x] = np.cos(angle) * b[..., x] + np.sin(angle) * b[..., z]
    turned[..., z] = np.cos(angle) * b[..., z] - np.sin(angle) * b[..., x]
    apart = np.sqrt(np.mean(np.sum(np.square(a - turned), axis=-1), axis=-1))
    return bool(apart.max() < SAME)


def _continuations(motions: Motions) -> Iterator[ClipPair]:
    """Yield clips whose first frame is another's last one, or the next, where it was captured."""
    able = [i for i, motion in enumerate(motions) if len(motion) >= FEWEST]
    if not able or motions[0].shape[1] < FEWEST_JOINTS:
        return
    starts = np.stack([motions[clip][:2] for clip in able])
    steps = starts[:, 1] - starts[:, 0]
    for first in able:
        before, last = motions[first][-2:]
        step = last - before
        pace = _rms(step)
        # A loop ends where each of its copies begins.
        looped = _rms(last - motions[first][0]) < np.maximum(2.0 * pace, 5.0 * SAME)
        if pace < LEAST_STEP or looped:
            continue
        steady = _rms(steps - step) < STEADY * pace
        same = _rms(starts[:, 0] - last) < SAME
        follows = _rms(starts[:, 0] - last - step) < FOLLOWS * pace
        for found in np.flatnonzero(steady & (same | follows)):
            if able[found] != first:
                yield ClipPair(first, able[found], "continues")


def _rms(moves: Annotated[Floats, "*clips joints 3"]) -> Annotated[Floats, "*clips"]:
    """Return the root mean square length over joints of moves (..., J, 3)."""
    return np.asarray(np.sqrt(np.mean(np.sum(np.square(moves), axis=-1), axis=-1)))
