"""Temporal alignment of clips by dynamic time warping (Mukai & Kuriyama 2006, section 2).

Clips are compared by joint positions relative to the root. In the first round the reference of
every clip is the medoid, and large families compare movements alone, without postures; in later
rounds it is the prediction from the other aligned clips.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from posefield.common.units import (
    UP,
    ClipBones,
    ClipFrames,
    ClipPaths,
    ClipPositions,
    ClipRotations,
    Floats,
    JointRotations,
    JointWeights,
    PerClip,
    RootPath,
    Traces,
)
from posefield.motion import curves, quat, skeleton
from posefield.motion.clip import Clip
from posefield_train.align import dtw
from posefield_train.align.warp import FIT_TIMES, WarpBasis
from posefield_train.jobs import Jobs, SerialJobs, ordered_results
from posefield_train.source import canonical
from posefield_train.source.canonical import heading
from posefield_train.source.ingest import Example

SERIAL = SerialJobs()
# Numbers of frames for the medoid and for warps; more frames do not improve the result.
COARSE, FINE = 25, 100
# A landmark is one of 501 samples; the weight makes the fitted warp pass through it.
LANDMARK_WEIGHT = 2000.0
# Keeps a reference that rests from a division by zero.
TINY = 1e-12
# Clips up to which each is compared with all others for the medoid, and as many of more clips.
LARGEST_COMPARED, MEDOID_SAMPLE = 299, 200


@dataclass(frozen=True)
class AlignedClips:
    """Clips in canonical time.

    rotations: (N, T, J, 4). root_path: (N, T, 3), m. Both are of no frames once they were released.
    logs: log increments (N, knots) of each clip's warp from its own time to canonical time.
    durations: (N,), s. reference: index of the medoid. curves: values (N, T, C); None for a family
    without curves.
    """

    rotations: ClipRotations
    root_path: ClipPaths
    logs: Annotated[Floats, "clips knots"]
    durations: PerClip
    reference: int
    curves: Annotated[Floats, "clips frames curves"] | None = None

    def without_poses(self) -> "AlignedClips":
        """Return the timing alone: the poses of thousands of clips take hundreds of megabytes."""
        rotations, root_path = self.rotations[:, :0].copy(), self.root_path[:, :0].copy()
        return replace(self, rotations=rotations, root_path=root_path, curves=None)


Predictor = Callable[[Floats], Floats]
"""Map from values (N, m) of all clips to the prediction (N, m) of each of them."""


@dataclass(frozen=True)
class Refinement:
    """Rounds in which clips are warped to their predictions from the other aligned clips."""

    rounds: int
    predict: Predictor


def align(
    examples: Sequence[Example],
    frames: int,
    basis: WarpBasis,
    joint_weights: JointWeights,
    refinement: Refinement | None,
    jobs: Jobs = SERIAL,
) -> AlignedClips:
    """Warp examples to one canonical time and resample them to `frames` frames.

    joint_weights: weights (J,) of the joints' positions in the comparison. refinement: None for
    identical warps. jobs: executor of the
    warps of many clips. The mean of the inverse warps is the identity, so canonical time is the
    average timing of the family.
    """
    traces = _ClipTraces(examples, np.sqrt(joint_weights))
    marks = _landmark_times(examples)
    knees = _breakpoints(marks, marks.mean(axis=0))
    medoid = _medoid(_align_piecewise(traces, knees, COARSE))
    if refinement is None:
        return _resample_all(
            examples, frames, basis, np.zeros((len(examples), basis.knots)), medoid
        )
    fine = _align_piecewise(traces, knees, FINE)
    compared = fine if len(fine) <= LARGEST_COMPARED else _movements(fine)
    logs = _centre(_warps_to(compared, compared[medoid], knees, basis, jobs), knees, basis)
    del compared
    for _ in range(refinement.rounds):
        pairs = zip(traces, logs, strict=True)
        warped = _stack(
            (interpolate(trace, basis.invert(log, _uniform_times(FINE))) for trace, log in pairs),
            len(examples),
        )
        predicted = refinement.predict(warped.reshape(len(warped), -1)).reshape(warped.shape)
        del warped
        logs = _centre(_warps_to(fine, predicted, knees, basis, jobs), knees, basis)
        del predicted
    return _resample_all(examples, frames, basis, logs, medoid)


@dataclass(frozen=True)
class _ClipTraces:
    """Traces of examples, made each time they are read: those of thousands take gigabytes."""

    examples: Sequence[Example]
    weights: JointWeights

    def __iter__(self) -> Iterator[Annotated[Floats, "_ features"]]:
        return (trace(example.clip, self.weights) for example in self.examples)


def _stack(rows: Iterable[Floats], count: int) -> Annotated[Floats, "{count} ..."]:
    """Return `np.stack` of `count` arrays of equal shapes, of which only one is held at a time."""
    stacked: Floats | None = None
    for index, row in enumerate(rows):
        if stacked is None:
            stacked = np.empty((count, *row.shape))
        stacked[index] = row
    assert stacked is not None and index == count - 1
    return stacked


@dataclass(frozen=True)
class CanonicalTime:
    """Canonical time of a trained model.

    frames: number of canonical frames. basis: basis of the warps. landmarks: their canonical times
    (M,). joint_weights: weights (J,) of the joints' positions.
    """

    frames: int
    basis: WarpBasis
    landmarks: Annotated[Floats, "landmarks"]
    joint_weights: JointWeights


def align_to(examples: Sequence[Example], references: Traces, canon: CanonicalTime) -> AlignedClips:
    """Warp examples to an existing canonical time, each to its own reference.

    references: traces (N, FINE, features) at uniform steps of canonical time.
    """
    traces = _ClipTraces(examples, np.sqrt(canon.joint_weights))
    knees = _breakpoints(_landmark_times(examples), np.sort(canon.landmarks))
    logs = _warps_to(_align_piecewise(traces, knees, FINE), references, knees, canon.basis, SERIAL)
    return _resample_all(examples, canon.frames, canon.basis, logs, medoid=0)


def _landmark_times(examples: Sequence[Example]) -> Annotated[Floats, "{len(examples)} landmarks"]:
    """Return the landmarks (N, M) as shares of the clips, in their order in time."""
    marks = np.array([example.landmarks for example in examples]).reshape(len(examples), -1)
    return np.sort(marks, axis=1)


def _resample_all(
    examples: Sequence[Example],
    frames: int,
    basis: WarpBasis,
    logs: Annotated[Floats, "clips knots"],
    medoid: int,
) -> AlignedClips:
    times = [basis.invert(log, _uniform_times(frames)) for log in logs]
    pairs = list(zip(examples, times, strict=True))
    values = [interpolate(e.clip.curve_values, np.clip(u, 0.0, 1.0)) for e, u in pairs]
    paths: list[RootPath] = []

    def rotations() -> Iterator[JointRotations]:
        for example, u in pairs:
            rotation_frames, path = resample(example.clip, u)
            paths.append(path)
            yield rotation_frames

    return AlignedClips(
        _stack(rotations(), len(examples)),
        np.stack(paths),
        logs,
        np.array([example.clip.duration for example in examples]),
        medoid,
        np.stack(values) if examples[0].clip.curves else None,
    )


def _uniform_times(frames: int) -> Annotated[Floats, "{frames}"]:
    return np.linspace(0.0, 1.0, frames)


def trace(clip: Clip, weights: JointWeights) -> Annotated[Floats, "frames features"]:
    """Return joint positions (F, J * 3), m, relative to root and heading, times weights (J,).

    Curves follow, each as the distance that it counts as.
    """
    joint_positions = clip.positions() - (clip.root_path * (1.0 - UP))[:, None]
    facing = quat.from_axis_angle(UP, -heading(clip))[:, None]
    body = (quat.rotate(facing, joint_positions) * weights[:, None]).reshape(len(clip), -1)
    if clip.curves is None:
        return body
    scaled = clip.curves.values * curves.distances(clip.curves.curves)
    return np.concatenate([body, scaled], axis=-1)


def interpolate(
    values: Annotated[Floats, "frames features"], u: Annotated[Floats, "asked"]
) -> Annotated[Floats, "asked features"]:
    """Interpolate rows of values (F, features) linearly at fractions u (S,) of their length.

    Returns (S, features).
    """
    return quat.interpolate_rows(values, u * (len(values) - 1))


@dataclass(frozen=True)
class _Breakpoints:
    """Breakpoints of piecewise linear time maps.

    times: clip times (N, M + 2). canonical: canonical times (M + 2,).
    """

    times: Annotated[Floats, "clips breakpoints"]
    canonical: Annotated[Floats, "breakpoints"]

    @property
    def weights(self) -> Annotated[Floats, "clips fitted"]:
        """Return the weight (N, 501) of each sample in the fit of a warp."""
        weights = np.ones((len(self.times), len(FIT_TIMES)))
        for row, times in zip(weights, self.times[:, 1:-1], strict=True):
            row[np.rint(times * (len(FIT_TIMES) - 1)).astype(np.int64)] = LANDMARK_WEIGHT
        return weights


def _breakpoints(
    marks: Annotated[Floats, "clips landmarks"], canonical: Annotated[Floats, "landmarks"]
) -> _Breakpoints:
    """Return breakpoints for landmarks (N, M) with canonical times (M,)."""
    bounds = np.zeros((len(marks), 1)), np.ones((len(marks), 1))
    return _Breakpoints(np.hstack([bounds[0], marks, bounds[1]]), np.array([0.0, *canonical, 1.0]))


def _align_piecewise(
    traces: Iterable[Annotated[Floats, "_ features"]], knees: _Breakpoints, frames: int
) -> Annotated[Floats, "clips {frames} features"]:
    """Resample traces to (N, frames, features), with landmarks aligned by piecewise linear maps."""
    times = [
        np.interp(_uniform_times(frames), knees.canonical, knee_times) for knee_times in knees.times
    ]
    pairs = zip(traces, times, strict=True)
    return _stack((interpolate(trace, u) for trace, u in pairs), len(times))


def _medoid(traces: Traces) -> int:
    """Return the index of the medoid of traces (N, F, features), in large families of a sample."""
    if len(traces) > LARGEST_COMPARED:
        mixed = np.random.Generator(np.random.PCG64(len(traces))).permutation(len(traces))
        some = np.sort(mixed[:MEDOID_SAMPLE])
        return int(some[_medoid(traces[some])])
    totals = [float(np.sum(np.sqrt(dtw.total_cost(traces, reference)))) for reference in traces]
    return int(np.argmin(np.round(totals, 9)))


def _movements(traces: Traces) -> Traces:
    """Return traces (N, F, features) less their means over time (decision 0025).

    Who sits and who stands differ more by posture than by movement, and time warping would trade
    time for posture: equal phases of their motions would get different canonical times.
    """
    return traces - traces.mean(axis=1, keepdims=True)


def _warps_to(
    traces: Traces,
    reference: Annotated[Floats, "... frames features"],
    knees: _Breakpoints,
    basis: WarpBasis,
    jobs: Jobs,
) -> Annotated[Floats, "clips knots"]:
    """Return log increments (N, knots) of the warps to a reference.

    reference: (F, features), or one per clip (N, F, features).
    """
    straight = np.stack(
        [np.interp(FIT_TIMES, knee_times, knees.canonical) for knee_times in knees.times]
    )
    paths = _phases(traces, reference, jobs)
    # Time warping may shift a landmark: the phases are rescaled so that it returns to its time.
    phases = [
        np.interp(phase, np.interp(knees.canonical, _uniform_times(FINE), phase), knees.canonical)
        for phase in paths
    ]
    warps = np.stack(
        [np.interp(s, _uniform_times(FINE), p) for s, p in zip(straight, phases, strict=True)]
    )
    # Where a clip begins in another pose than its reference, the path hurries to where they are
    # alike: without stiffness, motions that differ by chance would have steep time functions.
    listed = zip(warps, knees.weights, _time_errors(traces, reference, paths), strict=True)
    return np.stack([basis.fit(*arguments) for arguments in listed])


def _time_errors(
    traces: Traces, reference: Annotated[Floats, "... frames features"], paths: ClipFrames
) -> PerClip:
    """Return the errors (N,) of warped times, as shares of the clip.

    In such a time the reference moves as far as traces are from it after warping.
    """
    references = np.broadcast_to(reference, traces.shape)
    pairs = zip(traces, references, paths, strict=True)
    distances = [np.mean(np.square(a - interpolate(b, path))) for a, b, path in pairs]
    steps = [np.mean(np.square(np.diff(one, axis=0))) for one in references]
    return np.sqrt(np.divide(distances, np.maximum(steps, TINY))) / (FINE - 1)


def _phases(
    traces: Traces, reference: Annotated[Floats, "... frames features"], jobs: Jobs
) -> ClipFrames:
    """Return `dtw.warp` of traces, block by block of clips."""
    references = np.broadcast_to(reference, traces.shape)
    blocks = canonical.clip_blocks(len(traces))
    return np.concatenate(
        ordered_results(jobs, dtw.warp, ((traces[rows], references[rows]) for rows in blocks))
    )


def _centre(
    logs: Annotated[Floats, "clips knots"], knees: _Breakpoints, basis: WarpBasis
) -> Annotated[Floats, "clips knots"]:
    """Return the warps composed with their mean inverse.

    The mean inverse of the results is the identity.
    """
    mean_inverse = np.mean([basis.invert(log, FIT_TIMES) for log in logs], axis=0)
    even = [np.interp(basis.evaluate(log, FIT_TIMES), FIT_TIMES, mean_inverse) for log in logs]
    return np.stack([basis.fit(warp, w) for warp, w in zip(even, knees.weights, strict=True)])


def resample(
    clip: Clip, u: Annotated[Floats, "asked"]
) -> tuple[Annotated[Floats, "asked joints 4"], Annotated[Floats, "asked 3"]]:
    """Return rotations (S, J, 4) and root path (S, 3) at fractions u (S,) of the duration."""
    frame = np.clip(u, 0.0, 1.0) * (len(clip) - 1)
    before = np.minimum(frame.astype(np.int64), len(clip) - 2)
    share = frame - before
    rotations = quat.slerp(clip.rotations[before], clip.rotations[before + 1], share[:, None])
    return rotations, interpolate(clip.root_path, np.clip(u, 0.0, 1.0))


def joint_positions(
    aligned: AlignedClips, parents: tuple[int, ...], offsets: ClipBones
) -> ClipPositions:
    """Return joint positions (N, T, J, 3), m, of aligned clips with bone offsets (N, J, 3), m."""
    translations = skeleton.translations(offsets, aligned.root_path)
    return skeleton.positions(parents, aligned.rotations, translations)
