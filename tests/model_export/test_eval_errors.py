"""Tests of error measures on motions with known distances."""

import math

import numpy as np
import pytest

from posefield.common.units import UP
from posefield.motion import quat
from posefield_train.evaluate import motion_errors
from posefield_train.evaluate.motion_errors import ComparedMotion
from posefield_train.tensor.motion_tensor import FRAMES

ROUNDING = 1e-9
FEET = (1,)


def made(points, duration=1.0, event=None):
    return ComparedMotion(points, duration, event)


@pytest.fixture
def captured(rng):
    """A body of four joints that wanders smoothly, with its shell."""
    t = np.linspace(0.0, 1.0, FRAMES)[:, None, None]
    joints = np.sin(3.0 * t + rng.uniform(0.0, 6.0, (1, 4, 3))) + 0.5 * t**2
    shell = joints[:, :, None] + motion_errors.SHELL_RADIUS * np.eye(3)
    return made(np.concatenate([joints[:, :, None], shell], axis=2), 1.5, np.zeros(3))


def test_a_motion_lies_nowhere_from_itself(captured):
    found = motion_errors.compare_motions(captured, captured, FEET)
    for name in ("relative", "absolute", "plain_relative", "plain_absolute", "shell"):
        assert getattr(found, name).largest < ROUNDING
    assert found.duration == found.effector == 0.0
    assert found.acceleration == found.peak == pytest.approx(1.0)
    assert found.ends == pytest.approx(found.ends_captured)
    assert found.skate == found.skate_captured > 0.0


def test_a_body_put_elsewhere_is_globally_wrong_and_relatively_right(captured):
    away = np.array([0.3, 0.0, 0.4])
    found = motion_errors.compare_motions(made(captured.points + away, 1.5, away), captured, FEET)
    assert found.absolute.mean == pytest.approx(0.5)
    assert found.plain_absolute.rms == pytest.approx(0.5)
    assert found.effector == pytest.approx(0.5)
    assert found.relative.largest < ROUNDING
    # Negative control: a single joint out of its place is not forgiven.
    points = captured.points.copy()
    points[:, 2] += away
    bent = motion_errors.compare_motions(made(points, 1.5), captured, FEET)
    assert bent.relative.largest == pytest.approx(0.5, abs=0.1)
    assert bent.relative.mean > 0.05


def test_another_pace_is_forgiven_by_the_warped_distances_alone(captured):
    t = np.linspace(0.0, 1.0, FRAMES)
    early = t + 0.15 * np.sin(np.pi * t) * t
    place = early / early[-1] * (FRAMES - 1)
    flat = captured.points.reshape(FRAMES, -1)
    rows = np.stack([np.interp(place, np.arange(FRAMES), column) for column in flat.T], axis=1)
    found = motion_errors.compare_motions(
        made(rows.reshape(captured.points.shape), 1.5), captured, FEET
    )
    assert found.plain_relative.mean > 5 * found.relative.mean
    # Half a frame of a body this fast.
    assert found.relative.mean < 0.02


def test_what_turns_about_itself_is_seen_by_the_shell_alone(captured):
    points = captured.points.copy()
    turn = quat.from_axis_angle(np.array([0.0, 0.0, 1.0]), np.array(np.pi / 2))
    spun = quat.rotate(turn, points[:, 3, 1:] - points[:, 3, :1])
    points[:, 3, 1:] = points[:, 3, :1] + spun
    found = motion_errors.compare_motions(made(points, 1.5), captured, FEET)
    assert found.relative.largest < ROUNDING
    assert found.shell.largest == pytest.approx(motion_errors.SHELL_RADIUS * math.sqrt(2.0))


def test_a_foot_that_slides_at_a_known_speed_does():
    points = np.zeros((FRAMES, 2, 4, 3))
    points[:, 1, 0, 0] = np.linspace(0.0, 0.6, FRAMES)
    assert motion_errors.skate(made(points, 2.0), FEET) == pytest.approx(0.3)
    # A foot in the air may move as it likes.
    points[:, 1, 0] += np.outer(np.linspace(0.0, 1.0, FRAMES) > 0.5, UP)
    assert motion_errors.skate(made(points, 2.0), FEET) == pytest.approx(0.3)
    points[FRAMES // 2 :, 1, 0, 0] *= 9.0
    assert motion_errors.skate(made(points, 2.0), FEET) == pytest.approx(0.3)
    assert motion_errors.skate(made(points, 2.0), ()) == 0.0


def test_jerks_are_counted(captured, rng):
    shaken = made(captured.points + 0.01 * rng.standard_normal((FRAMES, 4, 1, 3)), 1.5)
    assert motion_errors.compare_motions(shaken, captured, FEET).acceleration > 3.0


def test_a_snap_is_seen_at_its_end_and_a_hurry_in_seconds_alone(captured):
    points = captured.points.copy()
    points[:2, 2:] += 0.3
    found = motion_errors.compare_motions(made(points, 1.5), captured, FEET)
    assert found.peak > 5.0 and found.ends[0] > 3.0 * found.ends_captured[0]
    assert found.ends[1] == pytest.approx(found.ends_captured[1])
    hurried = motion_errors.compare_motions(made(captured.points, 0.75), captured, FEET)
    assert hurried.acceleration == pytest.approx(1.0) and hurried.peak == pytest.approx(4.0)


def test_without_an_event_there_is_no_effector(captured):
    assert math.isnan(motion_errors.compare_motions(made(captured.points), captured, FEET).effector)


def test_the_mean_pools_squares_and_keeps_the_largest(captured):
    near, far = (
        motion_errors.compare_motions(
            made(captured.points + np.array([d, 0.0, 0.0]), 1.5 * k), captured, FEET
        )
        for d, k in ((0.1, 1.0), (0.7, 2.0))
    )
    both = motion_errors.mean([near, far])
    assert both.absolute.mean == pytest.approx(0.4)
    assert both.absolute.rms == pytest.approx(0.5)
    assert both.absolute.largest == pytest.approx(0.7)
    assert both.duration == pytest.approx(math.log(2.0) / math.sqrt(2.0))
