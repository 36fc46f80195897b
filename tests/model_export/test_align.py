"""Tests of temporal alignment on a family with known warps."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from posefield.common.units import UP
from posefield.kriging.support import half_ranges
from posefield.motion import clip, quat
from posefield.motion.skeleton import Skeleton
from posefield_train.align import dtw, time_alignment
from posefield_train.align.time_alignment import Refinement
from posefield_train.align.warp import FIT_TIMES, WarpBasis
from posefield_train.kriging import kriging_tuning
from posefield_train.kriging.sample_points import SamplePoints
from posefield_train.kriging.tuning_loss import TuningProblem
from posefield_train.source.clip_table import ClipRow
from posefield_train.source.ingest import Example

PARENTS = (-1, 0, 1, 2)
JOINTS = Skeleton(
    ("hips", "chest", "arm", "hand"),
    PARENTS,
    np.array([[0, 0.9, 0], [0, 0.4, 0], [0.3, 0, 0], [0.3, 0, 0.0]]),
    (),
    np.zeros((0, 3)),
)
BASIS = WarpBasis(6)
CLIPS, FRAMES, EVENT = 12, 60, 0.4
CANONICAL = np.linspace(0.0, 1.0, FRAMES)
WEIGHTS = np.ones(4)


def poses(s, size):
    """Rotations (S, J, 4) and root path (S, 3) of a reach of some size at canonical times (S,)."""
    bell = np.exp(-0.5 * ((s - EVENT) / 0.12) ** 2)
    angles = [0.3 * s, 0.2 * np.sin(4 * s), size * bell, 0.8 * size * np.sin(6 * s) * s]
    axes = [UP, np.array([1.0, 0, 0]), np.array([0, 0, 1.0]), UP]
    rotations = np.stack(
        [quat.from_axis_angle(a, v) for a, v in zip(axes, angles, strict=True)], axis=1
    )
    return rotations, np.stack([0.5 * s, 0.9 + 0.05 * bell, 0.1 * s**2], axis=1)


def example(size, times, landmarks=()):
    """Clip that is at canonical time `times` (F,) at each of its frames."""
    rotations, path = poses(times, size)
    row = ClipRow(Path("x.bvh"), "clips.csv", 2, "", 0, None, np.array([size]), ())
    own = clip.assemble(JOINTS, rotations, path, JOINTS.offsets, 60.0)
    return Example(row, own, row.controls, landmarks, jumps=())


@pytest.fixture
def logs(rng):
    return 0.4 * rng.normal(size=(CLIPS, BASIS.knots))


@pytest.fixture
def family(logs, rng):
    """Examples, each of its own length, pace and size."""
    frames = rng.integers(70, 130, CLIPS)
    sizes = np.linspace(0.9, 1.1, CLIPS)
    return [
        example(size, BASIS.evaluate(log, np.linspace(0.0, 1.0, count)))
        for size, log, count in zip(sizes, logs, frames, strict=True)
    ]


def to_the_mean(values):
    """The reference of all clips alike."""
    return np.broadcast_to(values.mean(axis=0), values.shape)


def to_the_prediction(family):
    """Return a predictor of each from the others by kriging over its size, as in training."""
    sizes = np.array([e.controls for e in family])
    laid = SamplePoints(
        half_ranges(sizes, sizes.min(axis=0), sizes.max(axis=0)), 1, np.arange(CLIPS)
    )
    return lambda v: v - kriging_tuning.tune(TuningProblem(laid, v), "matern52", 1).residuals


def aligned(family, rounds=2, weights=WEIGHTS, predict=to_the_mean):
    return time_alignment.align(family, FRAMES, BASIS, weights, Refinement(rounds, predict))


def disagreement(found, true):
    """Root-mean-square by which clips disagree on when the same canonical moment happens.

    A reparametrisation that all clips share is no fault: canonical time is the family's own.
    """
    moments = np.stack(
        [
            BASIS.evaluate(own, BASIS.invert(known, FIT_TIMES))
            for own, known in zip(found, true, strict=True)
        ]
    )
    return np.sqrt(np.mean(moments.var(axis=0)))


@pytest.fixture(params=["mean", "prediction"])
def found(request, family):
    """The family aligned to either reference."""
    predict = to_the_prediction(family) if request.param == "prediction" else to_the_mean
    return aligned(family, predict=predict)


def test_known_warps_are_recovered_and_their_mean_is_the_identity(found, logs):
    # Paths go from frame to frame of 100.
    assert disagreement(found.logs, logs) < 0.006
    assert disagreement(np.zeros_like(logs), logs) > 0.04
    means = (
        np.mean([BASIS.invert(log, FIT_TIMES) for log in own], axis=0) for own in (found.logs, logs)
    )
    warped, plain = (np.max(np.abs(mean - FIT_TIMES)) for mean in means)
    # What six increments cannot follow of the correction.
    assert warped < 0.004 and plain > 0.02


def test_what_others_predict_aligns_better_than_the_mean_where_clips_differ(logs):
    """Arms that swing three times as far: the mean is like neither end of the family."""
    own = [
        example(size, BASIS.evaluate(log, np.linspace(0.0, 1.0, 100)))
        for size, log in zip(np.linspace(0.5, 1.5, CLIPS), logs, strict=True)
    ]
    to_mean = disagreement(aligned(own).logs, logs)
    predicted = disagreement(aligned(own, predict=to_the_prediction(own)).logs, logs)
    # Over ten draws of the warps 4 to 11 % less.
    assert predicted < 0.98 * to_mean
    # Negative control: predicted from sizes of others, of which neighbours differ most.
    shuffled = to_the_prediction(own[::2] + own[1::2])
    assert disagreement(aligned(own, predict=shuffled).logs, logs) > 0.98 * to_mean


def test_weights_of_joints_decide_what_is_aligned(rng):
    """Two joints that tell of different times: the heavier is believed."""

    def two_minds(size, times, other):
        right = example(size, times)
        rotations = right.clip.rotations.copy()
        rotations[:, 1] = poses(other, 1.0)[0][:, 2]
        return replace(right, clip=replace(right.clip, rotations=rotations))

    u = np.linspace(0.0, 1.0, 90)
    first, second = 0.4 * rng.normal(size=(2, 8, BASIS.knots))
    family = [
        two_minds(1.0, BASIS.evaluate(a, u), BASIS.evaluate(b, u))
        for a, b in zip(first, second, strict=True)
    ]
    even = aligned(family)
    # Where the arm is follows from the chest alone.
    arm = aligned(family, weights=np.array([1.0, 1.0, 400.0, 1.0]))
    assert disagreement(arm.logs, second) < 0.7 * disagreement(even.logs, second)
    assert disagreement(arm.logs, first) > disagreement(even.logs, first)


def test_clips_that_differ_by_chance_keep_an_even_pace(rng):
    """Joints tremble by as much as they move: what time warping finds is chance."""
    clips = []
    for one in (example(1.0, CANONICAL) for _ in range(CLIPS)):
        angles = np.cumsum(0.06 * rng.normal(size=one.clip.rotations.shape[:2]), axis=0)
        trembling = quat.from_axis_angle(np.array([0, 0, 1.0]), angles)
        rotations = quat.mul(one.clip.rotations, trembling)
        clips.append(replace(one, clip=replace(one.clip, rotations=rotations)))
    even = np.zeros((CLIPS, BASIS.knots))
    traces = np.stack([time_alignment.trace(one.clip, WEIGHTS) for one in clips])
    paths = dtw.warp(traces, traces.mean(axis=0))
    dense = [np.interp(FIT_TIMES, CANONICAL, path) for path in paths]
    ones = np.ones(len(FIT_TIMES))
    loose = np.stack([BASIS.fit(path, ones) for path in dense])
    assert disagreement(aligned(clips).logs, even) < 0.5 * disagreement(loose, even)


def test_landmark_is_met_by_every_clip(family, logs, rng):
    """Shifted from where the motion itself would align, so that only the landmark can do it."""
    marks = [BASIS.invert(log, np.array([EVENT]))[0] + rng.uniform(-0.1, 0.1) for log in logs]

    def spread(clips):
        pairs = zip(aligned(clips).logs, marks, strict=True)
        return np.ptp([BASIS.evaluate(log, np.array([mark]))[0] for log, mark in pairs])

    assert spread([replace(e, landmarks=(m,)) for e, m in zip(family, marks, strict=True)]) < 0.03
    assert spread(family) > 0.05, "negative control: without landmarks"


def raised(posture, count):
    """Clips at an even pace whose arm rises by equal angles, half of them from a posture higher."""

    def one(start):
        angle = start + 0.8 * CANONICAL
        turns = np.stack([0.0 * angle, 0.0 * angle, angle, 0.5 * angle], axis=1)
        rotations = quat.from_axis_angle(np.array([0, 0, 1.0]), turns)
        row = ClipRow(Path("x.bvh"), "clips.csv", 2, "", 0, None, np.array([start]), ())
        path = np.tile([0.0, 0.9, 0.0], (FRAMES, 1))
        own = clip.assemble(JOINTS, rotations, path, JOINTS.offsets, 60.0)
        return Example(row, own, row.controls, (), jumps=())

    return [one(0.0), one(posture)] * (count // 2)


def test_a_large_family_is_aligned_by_movements_not_by_postures():
    even = np.zeros((300, BASIS.knots))
    found = aligned(raised(0.2, 300), 0).logs
    assert disagreement(found, even) < 0.01
    # Negative control: a small family trades time for posture.
    assert disagreement(aligned(raised(0.2, 40), 0).logs, even[:40]) > 0.03
    assert disagreement(aligned(raised(0.0, 300), 0).logs, even) < 1e-6
