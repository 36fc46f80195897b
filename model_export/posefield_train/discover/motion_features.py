"""Features of the frames of recordings, in which equal motions are near wherever they happen."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from posefield.common.units import Floats, Indices
from posefield_train.discover.recordings import Recording

STEPS = ((1, 1), (1, 2), (2, 1))
"""Frames of query and corpus by which a match advances."""


@dataclass(frozen=True)
class Ends:
    """Best match for each last frame of the corpus.

    costs (F,): mean distance over the frames of the query; inf without a match. starts (F,): first
    frame of the match.
    """

    costs: Floats
    starts: Indices


def match_ends(distances: Floats) -> Ends:
    """Return the best match that ends at each frame of the corpus.

    distances (L, F): of the query's frames from the corpus's; inf between two recordings.
    """
    length, frames = distances.shape
    starts = np.arange(frames)
    before: tuple[Floats, Indices] | None = None
    last = distances[0], starts
    for at in range(1, length):
        row = distances[at]
        costs = np.full(frames, np.inf)
        costs[1:] = last[0][:-1] + row[1:]
        origin = np.zeros(frames, dtype=np.int64)
        origin[1:] = last[1][:-1]
        _take_better((costs, origin), last, 2, row)
        if before is not None:
            _take_better((costs, origin), before, 1, row + distances[at - 1])
        before, last = last, (costs, origin)
    costs, starts = last
    return Ends(costs / length, starts)


def _take_better(
    best: tuple[Floats, Indices], row: tuple[Floats, Indices], step: int, added: Floats
) -> None:
    """Replace the best costs and starts where those of a row, `step` frames later, cost less."""
    costs = row[0][:-step] + added[step:]
    better = costs < best[0][step:]
    np.copyto(best[0][step:], costs, where=better)
    np.copyto(best[1][step:], row[1][:-step], where=better)


def align(distances: Floats) -> Indices:
    """Return for each frame of the query (L,) the frame of a clip (F,) that is most like it.

    distances (L, F): of their frames. The first frames are alike, and the last ones; steps are
    those of a match. A frame of the query that a step leaves out shares the frame after. Raises
    ValueError for a clip that lasts less than half as long as the query, or more than twice.
    """
    length, frames = distances.shape
    costs = np.full((length, frames), np.inf)
    steps = np.zeros((length, frames), dtype=np.int64)
    costs[0, 0] = distances[0, 0]
    for at in range(1, length):
        choices = np.full((len(STEPS), frames), np.inf)
        choices[0, 1:] = costs[at - 1, :-1]
        choices[1, 2:] = costs[at - 1, :-2]
        if at > 1:
            choices[2, 1:] = costs[at - 2, :-1] + distances[at - 1, 1:]
        steps[at] = np.argmin(choices, axis=0)
        costs[at] = choices.min(axis=0) + distances[at]
    if not np.isfinite(costs[-1, -1]):
        raise ValueError(f"{frames} frames, expected {length // 2 + 1} to {2 * length - 1}")
    return _path(steps)


def _path(steps: Indices) -> Indices:
    """Return the frames (L,) of the best path, from the step (L, F) that led to each place."""
    row, column = steps.shape[0] - 1, steps.shape[1] - 1
    frames = np.zeros(row + 1, dtype=np.int64)
    while row > 0:
        rows, columns = STEPS[steps[row, column]]
        frames[row - rows + 1 : row + 1] = column
        row, column = row - rows, column - columns
    return frames


RATE = 30.0
"""Frames a second at which features are measured."""
SEARCH_RATE = 10.0
"""Frames a second at which they are compared."""
WEIGHTS = {
    "hips": 1.0,
    "neck": 1.0,
    "head": 0.5,
    **{
        side + role: weight
        for side in ("left", "right")
        for role, weight in (
            ("UpperArm", 0.4),
            ("LowerArm", 1.0),
            ("Hand", 1.0),
            ("UpperLeg", 0.5),
            ("LowerLeg", 1.0),
            ("Foot", 1.0),
            ("Toes", 0.5),
        )
    },
}
"""Weight of the place of each role's joint; roles that a recording lacks do not count."""
TRAVEL_WEIGHT, TURN_WEIGHT = 0.25, 0.15
"""Weights of the planar velocity of the root, leg lengths a second, and of its turn, rad/s."""
VELOCITY_SPAN = 0.1
"""Half the time over which a velocity is measured, s."""
EXPLAINED = 0.9
"""Share of the variance that the principal components keep."""
STILL = 1e-6
"""Largest range of a feature of recordings in which nothing moves, leg lengths."""


class StillRecordings(ValueError):
    """Recordings in which nothing moves."""


@dataclass(frozen=True)
class Span:
    """Part of a recording. recording: index. start, end: s."""

    recording: int
    start: float
    end: float

    @property
    def seconds(self) -> float:
        """Return the duration, s."""
        return self.end - self.start

    def overlap(self, other: "Span") -> float:
        """Return the common time as a share of the shorter one."""
        if self.recording != other.recording:
            return 0.0
        common = min(self.end, other.end) - max(self.start, other.start)
        return max(common, 0.0) / min(self.seconds, other.seconds)


@dataclass(frozen=True)
class Corpus:
    """Features of recordings in one basis.

    roles: joints whose places are compared. features: (F, k) of each recording, at SEARCH_RATE.
    """

    recordings: tuple[Recording, ...]
    roles: tuple[str, ...]
    features: tuple[Floats, ...]

    def frames(self, span: Span) -> tuple[int, int]:
        """Return the first and the last recorded frame of a part of a recording."""
        recording = self.recordings[span.recording]
        first, last = (
            max(min(round(time * recording.rate), len(recording) - 1), recording.first)
            for time in (span.start, span.end)
        )
        return first, last

    def is_whole(self, span: Span) -> bool:
        """Return whether no joint leaps within a part of a recording."""
        return self.recordings[span.recording].is_whole(*self.frames(span))


def build_corpus(recordings: Sequence[Recording]) -> Corpus:
    """Return the features of recordings, which may have different skeletons.

    Raises StillRecordings for recordings in which nothing moves.
    """
    lacking = lacking_roles(recordings)
    roles = tuple(role for role in WEIGHTS if role not in lacking)
    raw = [recording_features(recording, roles) for recording in recordings]
    mean, basis = principal_components(np.concatenate(raw))
    step = round(RATE / SEARCH_RATE)
    return Corpus(
        tuple(recordings), roles, tuple((features[::step] - mean) @ basis for features in raw)
    )


def lacking_roles(recordings: Sequence[Recording]) -> list[str]:
    """Return the roles that a recording lacks, so that the recordings are not compared in them."""
    return [
        role for role in WEIGHTS if any(role not in recording.places for recording in recordings)
    ]


def recording_features(recording: Recording, roles: Sequence[str]) -> Floats:
    """Return the features (F, 3 R + 3) of a recording at RATE: places of R roles, travel and turn.

    Places are relative to the hips on the floor of the recording, in the heading of the hips.
    """
    times = np.arange(0.0, (len(recording) - 1) / recording.rate + 1e-9, 1.0 / RATE)
    frame_times = np.arange(len(recording)) / recording.rate
    angles = np.interp(times, frame_times, recording.headings())
    positions = {
        role: np.stack(
            [np.interp(times, frame_times, axis) for axis in recording.places[role].T], axis=1
        )
        for role in {*roles, "hips"}
    }
    floor = np.percentile(np.concatenate([positions[role][:, 1] for role in roles]), 1.0)
    base = positions["hips"] * [1.0, 0.0, 1.0] + [0.0, floor, 0.0]
    columns = [WEIGHTS[role] * _turned(positions[role] - base, -angles) for role in roles]
    travel = _turned(_velocity(positions["hips"]), -angles)[:, [0, 2]]
    turn = _velocity(angles[:, None])
    return np.concatenate([*columns, TRAVEL_WEIGHT * travel, TURN_WEIGHT * turn], axis=1)


def principal_components(values: Floats) -> tuple[Floats, Floats]:
    """Return the mean (d,) and the directions (d, k) that keep EXPLAINED of the variance.

    Raises StillRecordings without variance.
    """
    mean = values.mean(axis=0)
    if np.ptp(values, axis=0).max() < STILL:
        raise StillRecordings("nothing moves in the recordings, expected motions to compare")
    variances, directions = np.linalg.eigh(np.cov(values - mean, rowvar=False))
    share = np.cumsum(variances[::-1]) / variances.sum()
    count = int(np.searchsorted(share, EXPLAINED)) + 1
    return mean, np.asarray(directions[:, ::-1][:, :count])


def _turned(vectors: Floats, angles: Floats) -> Floats:
    x, y, z = vectors.T
    cos, sin = np.cos(angles), np.sin(angles)
    return np.stack([x * cos + z * sin, y, z * cos - x * sin], axis=1)


def _velocity(values: Floats) -> Floats:
    """Return the rates of change (F, k) of values (F, k) at RATE, per second."""
    half = round(VELOCITY_SPAN * RATE)
    padded = np.pad(values, ((half, half), (0, 0)), mode="edge")
    return np.asarray((padded[2 * half :] - padded[: -2 * half]) * RATE / (2 * half))


GAP = 2
"""Frames between two recordings, so that no match leads from one to the next."""


@dataclass(frozen=True)
class Match:
    """A clip that is like another one. cost: distance as a share of that of any clip."""

    span: Span
    cost: float


@dataclass(frozen=True)
class JoinedFeatures:
    """Features of recordings in a row.

    values (F, k): NaN in the gaps between recordings. owners (F,): recording of each frame, -1 in
    gaps. offsets: first frame of each recording.
    """

    values: Floats
    owners: Indices
    offsets: tuple[int, ...]

    @cached_property
    def variance(self) -> float:
        """Variance of all features, summed over the directions."""
        return float(self.values[self.owners >= 0].var(axis=0).sum())

    @cached_property
    def _searched(self) -> tuple[Floats, Floats]:
        """Features (F, k) with zero in gaps, and squares (F,) of their lengths, inf in gaps."""
        values = np.nan_to_num(self.values)
        squares = np.sum(np.square(values), axis=1)
        return values, np.where(self.owners < 0, np.inf, squares)

    def frames(self, span: Span) -> slice:
        """Return the frames of a part of a recording; its end may lie beyond the last one."""
        offset = self.offsets[span.recording]
        first, last = (offset + round(time * SEARCH_RATE) for time in (span.start, span.end))
        length = (
            len(self.owners)
            if span.recording + 1 == len(self.offsets)
            else self.offsets[span.recording + 1]
        )
        return slice(first, min(last + 1, length - GAP))

    def clip(self, span: Span) -> Floats:
        """Return the features (L, k) of a part of a recording."""
        return self.values[self.frames(span)]

    def span(self, first: int, last: int) -> Span:
        """Return the part of a recording between two frames, both included."""
        recording = int(self.owners[last])
        start, end = ((frame - self.offsets[recording]) / SEARCH_RATE for frame in (first, last))
        return Span(recording, float(start), float(end))

    def ends(self, span: Span) -> Ends:
        """Return the best match of a clip for each last frame, with relative costs.

        Costs are shares of the median over all places where a clip may end.
        """
        query, (values, squares) = self.clip(span), self._searched
        distances = np.sum(np.square(query), axis=1)[:, None] + squares
        distances -= 2.0 * query @ values.T
        np.sqrt(np.maximum(distances, 0.0, out=distances), out=distances)
        best = match_ends(distances)
        median = float(np.median(best.costs[np.isfinite(best.costs)]))
        return Ends(best.costs / median, best.starts)


def join_features(corpus: Corpus) -> JoinedFeatures:
    """Return the features of all recordings with gaps between them."""
    pieces, owners, offsets, count = [], [], [], 0
    for recording, features in enumerate(corpus.features):
        offsets.append(count)
        pieces += [features, np.full((GAP, features.shape[1]), np.nan)]
        owners += [np.full(len(features), recording), np.full(GAP, -1)]
        count += len(features) + GAP
    return JoinedFeatures(np.concatenate(pieces), np.concatenate(owners), tuple(offsets))
