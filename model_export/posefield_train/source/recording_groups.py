"""Recordings of clips, found by files and motions that share frames, mirror or continue others."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from posefield.common.units import Floats, Indices, Positions

# Words for left and right anywhere in a name, and letters that begin it, or end it after a
# separator.
WORDS = (("Left", "Right"), ("left", "right"))
LETTERS = (("L", "R"), ("l", "r"))
SEPARATORS = ("_", ".", "-", " ")


def mirrored_joints(names: tuple[str, ...]) -> tuple[int, ...]:
    """Return the index (J,) of each joint's counterpart on the other side, or its own."""
    rights = _right_by_left(names)
    counterparts = {**rights, **{right: left for left, right in rights.items()}}
    return tuple(names.index(counterparts.get(name, name)) for name in names)


def right_joints(names: tuple[str, ...]) -> list[int]:
    """Return the joints of the right side that have a counterpart on the left."""
    rights = set(_right_by_left(names).values())
    return [joint for joint, name in enumerate(names) if name in rights]


def _right_by_left(names: tuple[str, ...]) -> dict[str, str]:
    there, rights = set(names), dict[str, str]()
    for name in names:
        right = next((other for other in _right_names(name) if other in there), None)
        if right is not None and right not in rights.values():
            rights[name] = right
    return rights


def _right_names(name: str) -> Iterator[str]:
    """Yield the names that the counterpart of a left joint may have."""
    for left, right in WORDS:
        if left in name:
            yield name.replace(left, right)
    for left, right in LETTERS:
        if name.startswith(left):
            yield right + name.removeprefix(left)
        for separator in SEPARATORS:
            if name.endswith(separator + left):
                yield name.removesuffix(left) + right


SAME = 0.001
"""Root mean square distance of joints below which two frames are the same, m: a file that a tool
wrote again with fewer digits differs by less, two performances by more."""


def frame_features(motion: Positions) -> Annotated[Floats, "frames features"]:
    """Return heights of the joints and horizontal distances from the root (F, 2 J), m / sqrt(J).

    Features of two frames differ at most as much as their joint positions (F, J, 3), root mean
    square, after any turn about the vertical and any horizontal move.
    """
    relative = motion - motion[:, :1]
    away = np.hypot(relative[..., 0], relative[..., 2])
    joints = motion.shape[1]
    return np.concatenate([relative[..., 1], away], axis=1) / np.sqrt(joints)


CHECKED = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Shares of common frames at which features are compared before all joints are: a pose that is held
is like thousands of others."""


@dataclass(frozen=True)
class FrameIndex:
    """Frames of all clips, sorted by their joints' mean height above the root.

    features: (F, 2 J) of all frames. counts: frames of each clip. owners, frames: clip, and frame
    within it, of each. order: (F,) by mean height. heights: the sorted mean heights, m.
    """

    features: Floats
    counts: Indices
    owners: Indices
    frames: Indices
    order: Indices
    heights: Floats

    def like(self, query: Annotated[Floats, "_ features"]) -> Iterator[tuple[int, int]]:
        """Yield clip and frame of all frames from which on the features may be the wanted ones.

        They are compared at CHECKED of the frames that the clip and the wanted ones have.
        """
        height = _mean_heights(query[:1])[0]
        first, last = np.searchsorted(self.heights, [height - SAME, height + SAME])
        near = np.sort(self.order[first:last])
        common = np.minimum(self.counts[self.owners[near]] - self.frames[near], len(query)) - 1
        for share in CHECKED:
            offsets = (share * common).astype(int)
            distances = np.linalg.norm(self.features[near + offsets] - query[offsets], axis=1)
            near, common = near[distances < SAME], common[distances < SAME]
        for frame in near:
            yield int(self.owners[frame]), int(self.frames[frame])


def index_frames(features: Sequence[Floats]) -> FrameIndex:
    """Return the index of the frames of clips with features (F, 2 J) each."""
    lengths = [len(rows) for rows in features]
    joined = np.concatenate(features)
    heights = _mean_heights(joined)
    order = np.argsort(heights, kind="stable")
    return FrameIndex(
        joined,
        np.array(lengths),
        np.repeat(np.arange(len(lengths)), lengths),
        np.concatenate([np.arange(length) for length in lengths]),
        order,
        heights[order],
    )


def _mean_heights(features: Annotated[Floats, "frames features"]) -> Annotated[Floats, "frames"]:
    """Return the mean height (F,) of the joints above the root, m."""
    joints = features.shape[1] // 2
    return np.asarray(features[:, :joints].sum(axis=1) / np.sqrt(joints))


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
    index = index_frames([frame_features(motion) for motion in motions])
    # Views: of thousands of clips a second copy is hundreds of megabytes.
    features = np.split(index.features, np.cumsum(index.counts)[:-1])
    joints = len(swapped)
    other = np.array([*swapped, *(joints + joint for joint in swapped)])
    for second, motion in enumerate(motions):
        ways: dict[Relation, tuple[Floats, Floats]]
        ways = {"shares frames with": (features[second], motion)}
        if swapped != list(range(joints)):
            ways["mirrors"] = features[second][:, other], _mirrored(motion, swapped)
        for relation, (rows, positions) in ways.items():
            related = {second}
            for first, start in index.like(rows):
                # Two clips that begin together are found from both.
                if first in related or (start == 0 and first > second):
                    continue
                if _same_frames(motions[first][start:], positions):
                    related.add(first)
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
    distances = np.sqrt(np.mean(np.sum(np.square(a - turned), axis=-1), axis=-1))
    return bool(distances.max() < SAME)


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
        for index in np.flatnonzero(steady & (same | follows)):
            if able[index] != first:
                yield ClipPair(first, able[index], "continues")


def _rms(moves: Annotated[Floats, "*clips joints 3"]) -> Annotated[Floats, "*clips"]:
    """Return the root mean square length over joints of moves (..., J, 3)."""
    return np.asarray(np.sqrt(np.mean(np.sum(np.square(moves), axis=-1), axis=-1)))


def find_recordings(
    files: Sequence[str], names: Sequence[str], motions: Motions, joints: tuple[str, ...]
) -> tuple[list[str], list[str]]:
    """Return the recording of each clip, as the place of a file, and notes on groups of clips.

    Clips of one file are of one recording, and so are clips that share frames, mirror or continue
    each other. files: of each clip. names: of clips in notes. motions: joint positions (F, J,
    3), m, of each clip as captured. joints: their names.
    """
    pairs = find_pairs(motions, mirrored_joints(joints))
    across_files = [pair for pair in pairs if files[pair.first] != files[pair.second]]
    recordings = connected(files, across_files)
    return recordings, [*_pair_notes(names, across_files), *_file_notes(files)]


def connected(files: Sequence[str], pairs: Sequence[ClipPair]) -> list[str]:
    """Return for each clip the first file, by name, of all files that pairs connect.

    files: of each clip. pairs: of indices of clips.
    """
    above = {file: file for file in files}

    def top(file: str) -> str:
        while above[file] != file:
            file = above[file]
        return file

    for pair in pairs:
        low, high = sorted((top(files[pair.first]), top(files[pair.second])))
        above[high] = low
    return [top(file) for file in files]


STATE_RECORDINGS = "clips.recording states recordings"


def _pair_notes(names: Sequence[str], pairs: Sequence[ClipPair]) -> list[str]:
    notes = []
    for relation in ("mirrors", "shares frames with", "continues"):
        related = [pair for pair in pairs if pair.relation == relation]
        if not related:
            continue
        clips = len({clip for pair in related for clip in (pair.first, pair.second)})
        second, first = names[related[0].second], names[related[0].first]
        more = f"; {clips} clips have such a counterpart" if clips > 2 else ""
        notes.append(
            f"{second} {relation} {first}{more}: such clips are left out together as one recording "
            f"({STATE_RECORDINGS})"
        )
    return notes


def _file_notes(files: Sequence[str]) -> list[str]:
    _, counts = np.unique(files, return_counts=True)
    if counts.max() == 1 or len(counts) == 1:
        return []
    return [
        f"{counts[counts > 1].sum()} of {len(files)} clips share their file with others: clips of "
        f"one file are left out together as one recording ({STATE_RECORDINGS})"
    ]
