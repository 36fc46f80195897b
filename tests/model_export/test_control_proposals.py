"""Tests of proposed events and controls: residuals by refitting, and families of known truth."""

import numpy as np
import pytest

from posefield.motion.measures import MeasuredMotion
from posefield_train.discover import control_proposals
from posefield_train.discover.control_proposals import (
    FamilyClips,
    ProposedControl,
    RecordingPrediction,
)

ROLES = ("hips", "head", "leftHand", "rightHand", "leftToes", "rightToes")
REST = np.array(
    [[0, 1, 0], [0, 1.7, 0], [0.3, 0.9, 0], [-0.3, 0.9, 0], [0.1, 0, 0], [-0.1, 0, 0.1]], float
)
PERFORMERS, TAKES = 3, 12


def reaching(seed, count=36, moving=True):
    """A family whose right hand goes to a height and back, and whose head and hips follow.

    moving: whether they do; else each clip has the same motion and noise.
    """
    rng = np.random.default_rng(seed)
    motions = []
    for _ in range(count):
        wave = np.sin(np.linspace(0.0, np.pi, 40))[:, None] ** 2
        height = rng.uniform(0.2, 0.9) if moving else 0.5
        places = np.repeat(REST[None], 40, axis=0)
        places[:, 3] += wave * [0.0, height, 0.6 - 0.3 * height]
        places[:, 1] += wave * [0.0, 0.1 * height, 0.2 * height]
        places[:, 0] += wave * [0.1 * height, -0.2 + 0.2 * height, 0.0]
        places += rng.normal(0.0, 0.004, (1, len(ROLES), 3)) * [1.0, 0.0, 1.0]
        motions.append(MeasuredMotion(places, 1.3, np.zeros(3), (-1, 0, 0, 0, 0, 0), REST))
    recordings = [f"recording{at % TAKES}" for at in range(count)]
    performers = [f"p{at % TAKES % PERFORMERS}" for at in range(count)]
    joints = {role: at for at, role in enumerate(ROLES)}
    return FamilyClips(tuple(motions), joints, tuple(performers), tuple(recordings), False)


@pytest.mark.parametrize("seed", range(3))
def test_residuals_are_those_of_refitting_without_each_take(seed):
    rng = np.random.default_rng(seed)
    values, measures = rng.normal(size=(14, 5)), rng.normal(size=(2, 14))
    recordings = [f"t{at // 3}" for at in range(14)]
    prediction = RecordingPrediction(values, [f"p{at % 2}" for at in range(14)], recordings)
    covariance = prediction.covariance(list(measures))
    expected = np.zeros_like(values)
    for recording in set(recordings):
        own = np.array([other == recording for other in recordings])
        weights = np.linalg.solve(covariance[np.ix_(~own, ~own)], values[~own])
        expected[own] = values[own] - covariance[np.ix_(own, ~own)] @ weights
    found = prediction.residuals(list(measures))
    np.testing.assert_allclose(found, expected, atol=1e-10)
    # Leaving out single clips gives other residuals.
    single = RecordingPrediction(
        values, [f"p{at % 2}" for at in range(14)], [str(i) for i in range(14)]
    )
    assert np.abs(single.residuals(list(measures)) - expected).max() > 0.01


@pytest.mark.parametrize("seed", range(3))
def test_the_hand_that_a_family_depends_on_is_its_event_and_its_control(seed):
    found = control_proposals.propose_controls(reaching(seed))
    assert found.event is not None and found.event[0] == "rightHand"
    assert found.event[1] in ("highest", "farthest")
    assert ProposedControl("height", *found.event) in found.controls
    assert len(found.controls) <= control_proposals.MOST_CONTROLS
    assert found.remaining[0] < 0.2 and list(found.remaining) == sorted(found.remaining)[::-1]


def test_strides_are_controlled_by_their_gait():
    rng = np.random.default_rng(0)
    own = reaching(1)
    speeds = rng.uniform(0.5, 2.0, len(own.motions))
    motions = []
    for motion, speed in zip(own.motions, speeds, strict=True):
        travelled = np.linspace(0.0, speed, 40)[:, None, None] * [0.0, 0.0, 1.0]
        travel = np.array([0.0, speed, 0.1 * rng.normal()])
        motions.append(
            MeasuredMotion(REST + travelled, 1.0, travel, motion.parents, motion.offsets)
        )
    family = FamilyClips(tuple(motions), own.joints, own.performers, own.recordings, True)
    found = control_proposals.propose_controls(family)
    assert found.event is None
    assert [one.quantity for one in found.controls[:3]] == ["speed", "turn", "stride_length"]


def test_one_take_cannot_be_left_out():
    own = reaching(0)
    alone = FamilyClips(
        own.motions, own.joints, own.performers, ("a",) * len(own.recordings), False
    )
    with pytest.raises(ValueError, match="clips of one recording, expected two recordings or more"):
        control_proposals.propose_controls(alone)
