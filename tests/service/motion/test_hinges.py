"""Tests of the limits of knees and elbows."""

import numpy as np
import pytest

from posefield.motion import hinges, quat
from posefield.motion.hinges import FREE, MOST

AXIS, BONE = np.array([0.6, 0.0, 0.8]), np.array([0.0, -1.0, 0.0])
STRAIGHT = quat.exp(np.array([0.3, -0.4, 1.1]))
TWIST = 0.4
"""Amplitude of the twist of the bone below the made joint, rad."""


def made_arm(frames=500):
    """Return rotations (F, 1, 4) of an arm that bends from 0.1 to 2.1 rad while it twists."""
    phase = np.linspace(0.0, 2.0 * np.pi, frames)
    flexion, twist = 1.1 - np.cos(phase), TWIST * np.sin(3.0 * phase)
    bend = quat.mul(STRAIGHT, quat.from_axis_angle(AXIS, flexion))
    return quat.mul(bend, quat.from_axis_angle(BONE, twist))[:, None]


def measured(rotations):
    above = np.broadcast_to(quat.rotate(STRAIGHT, BONE), (len(rotations), 3))
    return hinges.measure(0, rotations[:, 0], above, np.broadcast_to(BONE, above.shape))


def test_axis_and_ranges_of_a_made_arm_are_measured():
    hinge = measured(made_arm())
    assert hinge.axis == pytest.approx(AXIS, abs=1e-3)
    assert abs(np.dot(hinge.reference, STRAIGHT)) == pytest.approx(1.0, abs=1e-4)
    assert hinge.low == pytest.approx([0.1, -TWIST, 0.0], abs=0.01)
    assert hinge.high == pytest.approx([2.1, TWIST, 0.0], abs=0.01)


def test_rotations_within_the_captured_range_are_the_same_array():
    limits, arm = hinges.from_card((measured(made_arm()),)), made_arm()
    assert limits.within(arm) is arm
    slightly = quat.mul(arm, quat.from_axis_angle(AXIS, np.full((500, 1), 0.9 * FREE)))
    assert limits.within(slightly) is slightly
    assert (
        limits.within(quat.mul(arm, quat.from_axis_angle(AXIS, np.full((500, 1), 0.1)))) is not arm
    )


def test_rotations_beyond_the_range_come_back_smoothly():
    limits = hinges.from_card((measured(made_arm()),))
    flexion = np.linspace(-1.5, 1.0, 2000)
    backwards = quat.mul(STRAIGHT, quat.from_axis_angle(AXIS, flexion))[:, None]
    angles = limits.angles(limits.within(backwards))
    assert (angles >= limits.low - MOST - 1e-9).all() and (angles <= limits.high + MOST).all()
    # Negative control: without limits the arm bends 1.5 rad the wrong way.
    assert limits.angles(backwards).min() == pytest.approx(-1.5, abs=0.01)
    # No frame turns back, and none turns faster than before.
    steps, before = np.diff(angles[:, 0, 0]), np.diff(flexion)
    assert (steps >= -1e-12).all() and (steps <= before * (1.0 + 1e-6)).all()


def test_turns_off_the_hinge_come_back_and_the_bend_stays():
    limits = hinges.from_card((measured(made_arm()),))
    sideways = quat.mul(
        made_arm(), quat.from_axis_angle(np.cross(AXIS, BONE), np.full((500, 1), 0.5))
    )
    off = limits.angles(limits.within(sideways))
    assert np.abs(off[..., 2]).max() <= MOST + np.abs([limits.low, limits.high])[..., 2].max()
    kept = limits.angles(sideways)[..., 0]
    assert (
        np.abs(off - np.clip(kept, limits.low[0, 0] - MOST, limits.high[0, 0] + MOST)[..., None])[
            ..., 0
        ].max()
        < MOST
    )


def test_slopes_are_those_of_the_limits():
    limits = hinges.from_card((measured(made_arm()),))
    rotation = quat.mul(STRAIGHT, quat.from_axis_angle(AXIS, 2.1 + 1.5 * FREE))[None]
    step = 1e-6
    for direction in np.eye(3):
        turned = quat.mul(rotation, quat.exp(step * direction))
        moved = quat.log(quat.mul(quat.conj(limits.within(rotation)), limits.within(turned)))
        slope = limits.slopes(limits.limit(limits.angles(rotation)))[0] @ direction
        assert moved[0] / step == pytest.approx(slope, abs=0.02)


def test_poses_are_limited_alike_alone_and_in_a_batch():
    limits, wild = (
        hinges.from_card((measured(made_arm()),)),
        quat.normalize(np.random.default_rng(5).normal(size=(300, 2, 1, 4))),
    )
    together = limits.within(wild)
    alone = np.stack([limits.within(pose[None])[0] for pose in wild[:, 0]])
    assert np.array_equal(together[:, 0], alone)


def test_a_straight_limb_has_no_axis():
    assert measured(np.broadcast_to(STRAIGHT, (9, 1, 4))) is None
