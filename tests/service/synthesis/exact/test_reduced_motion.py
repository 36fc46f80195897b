"""Tests of reduced motions: values equal to those of poses, and gradients."""

import numpy as np
import pytest
from beginning import begin

from posefield.constraints.constraint import (
    PositionConstraint,
    StepLengthConstraint,
    TravelConstraint,
)
from posefield.motion import skeleton
from posefield.motion.measures import Measure

SMALL = 1e-6


def aims(begun) -> list:
    """Everything that can be aimed at."""
    feet = begun.opened.card.feet or (begun.joint("LeftFoot"), begun.joint("RightFoot"))
    places = [
        begun.place(begun.opened.card.skeleton.names[-1], 17.3),
        PositionConstraint(("x",), Measure("height", feet, "highest"), (1,), np.zeros(1)),
        PositionConstraint(("x",), Measure("left", feet[:1], "farthest"), (0, 2), np.zeros(2)),
        StepLengthConstraint(("x",), Measure("step_length", feet), np.zeros(1)),
    ]
    if not begun.opened.card.cyclic:
        return places
    ways = [("speed", "m/s"), ("turn", "deg"), ("stride_length", "m")]
    return [*places, *(TravelConstraint(("x",), name, np.zeros(1), unit) for name, unit in ways)]


@pytest.mark.parametrize("name", ["reaching", "walking"])
def test_gradients_are_derivatives(name, request, rng):
    begun = request.getfixturevalue(name)
    scene, numbers = begun.held.scene, begun.held.numbers
    for aim in aims(begun):
        _, gradients = aim.evaluate(scene, numbers)
        along = rng.standard_normal(len(numbers))
        ends = [aim.evaluate(scene, numbers + step * along)[0] for step in (SMALL, -SMALL)]
        rise = (ends[0] - ends[1]) / (2.0 * SMALL)
        size = 1e-3 + np.abs(rise).max()
        assert np.abs(gradients @ along - rise).max() < 1e-5 * size
        # Negative control: the derivative in another direction is another one.
        other = gradients @ rng.standard_normal(len(numbers))
        assert np.abs(other - rise).max() > 1e-3 * size


@pytest.mark.parametrize("name", ["reaching", "walking"])
def test_poses_are_those_of_the_graph_at_every_level(name, request):
    opened = request.getfixturevalue(name).opened
    point = np.median(opened.card.examples, axis=0, keepdims=True)
    times, label = np.array([0.0, 0.3, 0.61]), np.eye(1, len(opened.card.performers))

    def asked(level):
        return opened.run(
            point, times[None], "rotations", "root_position", labels=label, level=level
        )

    for level in range(len(opened.card.levels)):
        held = begin(opened, level).held
        poses = held.poses(held.state.frames)
        gaps = [np.abs(a - b[0]).max() for a, b in zip(poses, asked(level), strict=True)]
        # The graph is of single precision.
        assert max(gaps) < 1e-5
        # Negative control: no two levels say the same.
        others = asked((level + 1) % len(opened.card.levels))
        assert max(np.abs(a - b[0]).max() for a, b in zip(poses, others, strict=True)) > 1e-5


@pytest.mark.parametrize("name", ["reaching", "walking"])
def test_positions_are_those_of_the_poses(name, request):
    begun = request.getfixturevalue(name)
    scene, numbers = begun.held.scene, begun.held.numbers
    frames = np.array([0.0, 7.25, float(scene.reduced.frames - 1)])
    rotations, roots = begun.held.poses(frames)
    translations = skeleton.translations(scene.bones[None], roots[None])
    positions, _ = skeleton.forward_kinematics(scene.parents, rotations[None], translations)
    for joint in range(len(scene.parents)):
        found = scene.positions(numbers, joint, frames)
        # Rotations of single precision are not quite of length one.
        assert np.abs(found - positions[0, :, joint]).max() < 1e-7
        one, _ = scene.position_and_gradient(numbers, joint, frames[1])
        assert np.abs(one - found[1]).max() < 1e-12
        # Negative control: a hundredth of a frame later they are elsewhere.
        later = scene.positions(numbers, joint, frames + np.array([0.01, 0.01, -0.01]))
        assert np.abs(later - positions[0, :, joint]).max() > 1e-6
