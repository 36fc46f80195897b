"""Tests of soles of robots that stand, on a made biped whose gait slides and sinks."""

import numpy as np
import pytest

from posefield.motion import quat
from posefield.robots.robot import Foot, Robot
from posefield.robots.standing_soles import SolePoint, StandingSoles

STEPS, AHEAD, TURN = 40, 0.4, 0.2
AXES = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0], [0, 1, 0], [0, 1, 0], [1, 0, 0]], float)
LEG = np.array([[0, 0.1, 0], [0, 0, -0.02], [0, 0, -0.02], [0, 0, -0.3], [0, 0, -0.3], [0, 0, 0]])
SOLE = np.array([[x, y, -0.05] for x in (-0.06, 0.12) for y in (-0.04, 0.04)])
FOOT = np.vstack([SOLE, [0.03, 0.0, -0.054]])
"""Soles bulge between their corners."""
HINGES = ("yaw", "roll", "pitch", "knee", "ankle", "ankle_roll")


def biped(knee_limit=2.0):
    """Return a robot of two legs with six hinges each; knees bend up to a limit, rad."""
    names = [f"{side}_{hinge}" for side in ("left", "right") for hinge in HINGES]
    parents = [-1, 0, 1, 2, 3, 4, 5, 0, 7, 8, 9, 10, 11]
    limits = np.tile([-2.0, 2.0], (12, 1))
    limits[[3, 9], 1] = knee_limit
    return Robot(
        "biped",
        ("base", *names),
        tuple(parents),
        np.vstack([[0.0, 0.0, 0.65], LEG, LEG * [1, -1, 1]]),
        np.tile(quat.IDENTITY, (13, 1)),
        tuple(names),
        tuple(range(1, 13)),
        np.vstack([AXES, AXES]),
        np.full((12, 3), 0.01),
        limits,
        (Foot(6, FOOT), Foot(12, FOOT)),
    )


def gait():
    """Return base path, base rotations and angles of a cycle that turns, slides and sinks."""
    share = np.arange(STEPS + 1) / STEPS
    headings = TURN * share
    # Arcs of the base, which sways.
    x, y = AHEAD / TURN * np.sin(headings), AHEAD / TURN * (1.0 - np.cos(headings))
    height = 0.63 + 0.01 * np.cos(4.0 * np.pi * share)
    rotations = quat.from_axis_angle(np.array([0.0, 0.0, 1.0]), headings)
    angles = np.zeros((STEPS + 1, 12))
    for first, begin in ((0, 0.0), (6, 0.5)):
        phase = 2.0 * np.pi * (share - begin)
        lift = np.maximum(-np.sin(phase), 0.0)
        angles[:, first + 2] = -0.4 - 0.18 * np.cos(phase) - 0.2 * lift
        angles[:, first + 3] = 0.8 + 0.5 * lift
        angles[:, first + 4] = -0.4 + 0.18 * np.cos(phase) - 0.3 * lift
    return np.stack([x, y, height], axis=-1), rotations, angles


def soles(stances=((1, 19),), later=((21, 39),)):
    """Return the corners of both soles with their stances."""
    return [
        SolePoint(body, tuple(corner), frames)
        for body, frames in ((6, stances), (12, later))
        for corner in SOLE.tolist()
    ]


def stands(robot, points, path, rotations, angles):
    """Return the largest distance of a standing point from its place over the floor, m."""
    positions, turns = robot.body_poses(path, rotations, angles)
    apart = []
    for point in points:
        place = positions[:, point.body] + quat.rotate(
            turns[:, point.body], np.array(point.position)
        )
        for first, last in point.stances:
            floor = place[first : last + 1, :2]
            apart.append(np.linalg.norm(floor - floor.mean(axis=0), axis=-1).max())
    return max(apart)


def lowest(robot, path, rotations, angles):
    points = robot.foot_points(*robot.body_poses(path, rotations, angles))
    return min(float(foot[..., 2].min()) for foot in points)


def solve(robot, points, path, rotations, angles):
    solver = StandingSoles(np, np.asarray, robot, points, STEPS)
    return solver.corrected(path, quat.to_matrix(rotations), angles)


def test_soles_stand_still_on_the_floor_within_limits():
    robot, points, motion = biped(), soles(), gait()
    assert stands(robot, points, *motion) > 0.01
    assert lowest(robot, *motion) < -0.01
    path, rotations, angles = motion
    standing = solve(robot, points, path, rotations, angles)
    # Corners stand at the means of their places as predicted, which are not quite a rigid sole.
    assert stands(robot, points, path, rotations, standing) < 1e-4
    assert lowest(robot, path, rotations, standing) > -5e-4
    np.testing.assert_array_equal(standing[0], standing[-1])
    narrow = biped(knee_limit=0.9)
    bounded = solve(narrow, points, path, rotations, angles)
    assert standing[:, 3].max() > 0.9 >= bounded[:, 3].max()


def test_a_stance_goes_on_over_the_seam_of_a_turning_cycle():
    robot, (path, rotations, angles) = biped(), gait()
    points = soles(later=((25, 45),))
    standing = solve(robot, points, path, rotations, angles)
    # The next cycle is this one turned and moved on.
    turn = quat.mul(rotations[-1], quat.conj(rotations[0]))
    path = np.vstack([path[:-1], path[-1] + quat.rotate(turn, path - path[0])])
    rotations = np.vstack([rotations[:-1], quat.mul(turn, rotations)])
    assert stands(robot, points, path, rotations, np.vstack([standing[:-1], standing])) < 1e-3
    assert stands(robot, points, path, rotations, np.vstack([angles[:-1], angles])) > 0.01


@pytest.mark.parametrize("hinge", [2, 9])
def test_swings_change_smoothly_and_standing_gaits_not_at_all(hinge):
    robot, (path, rotations, angles) = biped(), gait()
    points = soles()
    standing = solve(robot, points, path, rotations, angles)
    again = solve(robot, points, path, rotations, standing)
    np.testing.assert_allclose(again, standing, atol=2e-3)
    steps = np.abs(np.diff(standing[:, hinge], 2)).max()
    assert steps < 3.0 * np.abs(np.diff(angles[:, hinge], 2)).max() + 0.02
