"""Clips of different timing to one canonical time, and the warps that lead there and back.

Every clip is compared with a reference by what its joints do around the root. The first reference
is the medoid, the clip nearest to all others; in further rounds every clip has its own, what the
aligned others predict for it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from model_export import dtw
from model_export.ingest import Example, heading
from model_export.warp import DENSE, WarpBasis
from service.motion import blend, quat, skeleton
from service.motion.clip import Clip
from service.motion.conventions import UP, Floats

# Frames at which clips are compared: a medoid needs no more, a warp gains nothing from more.
COARSE, FINE = 25, 100
# A landmark is one sample among 501 that the warp has to meet.
LANDMARK_WEIGHT = 200.0


@dataclass(frozen=True)
class Aligned:
    """Clips in canonical time.

    rotations (N, T, J, 4) and root_path (N, T, 3). logs (N, knots): the log increments of each
    clip's warp from its own time to canonical time. durations (N,), s. reference: index of the
    medoid.
    """

    rotations: Floats
    root_path: Floats
    logs: Floats
    durations: Floats
    reference: int


Predict = Callable[[Floats], Floats]
"""Values (N, m) of all clips to what is predicted for each of them (N, m)."""


def align(
    examples: Sequence[Example],
    frames: int,
    basis: WarpBasis,
    rounds: int,
    joint_weights: Floats,
    predict: Predict,
) -> Aligned:
    """Examples warped to one canonical time and resampled to `frames` frames.

    joint_weights (J,): importance of each joint's position in the comparison. The mean warp is
    the identity: canonical time is the family's own average, not the reference's.
    """
    traces = [trace(example.clip, np.sqrt(joint_weights)) for example in examples]
    marks = _marks(examples)
    knees = _knees(marks, marks.mean(axis=0))
    medoid = _medoid(_straight(traces, knees, COARSE))
    fine = _straight(traces, knees, FINE)
    logs = _gauge(_round(fine, fine[medoid], knees, basis), knees, basis)
    for _ in range(rounds):
        pairs = zip(traces, logs, strict=True)
        warped = np.stack([at(trace, basis.invert(log, _even(FINE))) for trace, log in pairs])
        predicted = predict(warped.reshape(len(warped), -1)).reshape(warped.shape)
        logs = _gauge(_round(fine, predicted, knees, basis), knees, basis)
    return _aligned(examples, frames, basis, logs, medoid)


@dataclass(frozen=True)
class Canon:
    """A canonical time that is there already: its frames, the basis of its warps, and the times
    (M,) of landmarks in it. joint_weights (J,): importance of each joint's position."""

    frames: int
    basis: WarpBasis
    landmarks: Floats
    joint_weights: Floats


def align_to(examples: Sequence[Example], references: Floats, canon: Canon) -> Aligned:
    """Examples warped to a canonical time, each by its reference.

    references (N, FINE, features): traces in even steps of canonical time.
    """
    traces = [trace(example.clip, np.sqrt(canon.joint_weights)) for example in examples]
    knees = _knees(_marks(examples), canon.landmarks)
    logs = _round(_straight(traces, knees, FINE), references, knees, canon.basis)
    return _aligned(examples, canon.frames, canon.basis, logs, medoid=0)


def _marks(examples: Sequence[Example]) -> Floats:
    return np.array([example.landmarks for example in examples]).reshape(len(examples), -1)


def _aligned(
    examples: Sequence[Example], frames: int, basis: WarpBasis, logs: Floats, medoid: int
) -> Aligned:
    resampled = [
        resample(e.clip, basis.invert(log, _even(frames)))
        for e, log in zip(examples, logs, strict=True)
    ]
    return Aligned(
        np.stack([rotations for rotations, _ in resampled]),
        np.stack([path for _, path in resampled]),
        logs,
        np.array([example.clip.duration for example in examples]),
        medoid,
    )


def _even(frames: int) -> Floats:
    return np.linspace(0.0, 1.0, frames)


def trace(clip: Clip, weights: Floats) -> Floats:
    """Joint positions (F, J * 3) around the root, seen from its heading, m, times weights (J,)."""
    positions = clip.positions() - (clip.root_path * (1.0 - UP))[:, None]
    facing = quat.about(UP, -heading(clip))[:, None]
    return (quat.rotate(facing, positions) * weights[:, None]).reshape(len(clip), -1)


def at(values: Floats, u: Floats) -> Floats:
    """Rows (S, features) of values (F, features) at fractions u (S,) of the way through."""
    return blend.between(values, u * (len(values) - 1))


@dataclass(frozen=True)
class _Knees:
    """Clip times (N, M + 2) and canonical times (M + 2,) between which time runs evenly."""

    own: Floats
    canonical: Floats

    @property
    def weights(self) -> Floats:
        """What each sample of a warp is worth in its fit (N, 501)."""
        weights = np.ones((len(self.own), len(DENSE)))
        for row, own in zip(weights, self.own[:, 1:-1], strict=True):
            row[np.rint(own * (len(DENSE) - 1)).astype(np.int64)] = LANDMARK_WEIGHT
        return weights


def _knees(marks: Floats, canonical: Floats) -> _Knees:
    """Knees of landmarks (N, M) whose canonical times are (M,)."""
    ends = np.zeros((len(marks), 1)), np.ones((len(marks), 1))
    return _Knees(np.hstack([ends[0], marks, ends[1]]), np.array([0.0, *canonical, 1.0]))


def _straight(traces: list[Floats], knees: _Knees, frames: int) -> Floats:
    """Traces (N, frames, features) with their landmarks brought together by straight lines."""
    times = [np.interp(_even(frames), knees.canonical, own) for own in knees.own]
    return np.stack([at(trace, u) for trace, u in zip(traces, times, strict=True)])


def _medoid(traces: Floats) -> int:
    totals = [float(np.sum(np.sqrt(dtw.total_cost(traces, reference)))) for reference in traces]
    return int(np.argmin(np.round(totals, 9)))


def _round(traces: Floats, reference: Floats, knees: _Knees, basis: WarpBasis) -> Floats:
    """Log increments (N, knots) of the warps to a reference (F, features), or one a clip (N, F,
    features)."""
    straight = np.stack([np.interp(DENSE, own, knees.canonical) for own in knees.own])
    # Time warping may carry a landmark away: it is brought back, and what lies between with it.
    phases = [
        np.interp(phase, np.interp(knees.canonical, _even(FINE), phase), knees.canonical)
        for phase in dtw.warp(traces, reference)
    ]
    warps = np.stack([np.interp(s, _even(FINE), p) for s, p in zip(straight, phases, strict=True)])
    return np.stack([basis.fit(warp, w) for warp, w in zip(warps, knees.weights, strict=True)])


def _gauge(logs: Floats, knees: _Knees, basis: WarpBasis) -> Floats:
    """The same warps followed by the one that makes their mean inverse the identity."""
    mean_inverse = np.mean([basis.invert(log, DENSE) for log in logs], axis=0)
    even = [np.interp(basis.evaluate(log, DENSE), DENSE, mean_inverse) for log in logs]
    return np.stack([basis.fit(warp, w) for warp, w in zip(even, knees.weights, strict=True)])


def resample(clip: Clip, u: Floats) -> tuple[Floats, Floats]:
    """Rotations (S, J, 4) and root path (S, 3) at fractions u (S,) of the clip's duration."""
    place = np.clip(u, 0.0, 1.0) * (len(clip) - 1)
    before = np.minimum(place.astype(np.int64), len(clip) - 2)
    share = place - before
    rotations = quat.slerp(clip.rotations[before], clip.rotations[before + 1], share[:, None])
    return rotations, at(clip.root_path, np.clip(u, 0.0, 1.0))


def positions(aligned: Aligned, parents: tuple[int, ...], offsets: Floats) -> Floats:
    """Joint positions (N, T, J, 3) of aligned clips with bone offsets (N, J, 3), m."""
    translations = skeleton.translations(offsets, aligned.root_path)
    return skeleton.forward(parents, aligned.rotations, translations)[0]
