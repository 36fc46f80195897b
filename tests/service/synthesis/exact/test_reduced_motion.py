"""Tests of reduced motions: values equal to those of poses, and gradients."""

import numpy as np
import pytest
from beginning import begin

from posefield.constraints import gauss_newton
from posefield.constraints.constraint import (
    PositionConstraint,
    StepLengthConstraint,
    TravelConstraint,
)
from posefield.inference import reduced_motion, session
from posefield.kriging import kriging_model
from posefield.model_file import onnx_file
from posefield.motion import skeleton
from posefield.motion.measures import TRAVEL_QUANTITIES, Measure

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
    ways = [Measure(quantity) for quantity in TRAVEL_QUANTITIES]
    return [
        *places,
        *(TravelConstraint(("x",), way.quantity, np.zeros(1), way.unit) for way in ways),
    ]


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


def strays(trained) -> np.ndarray:
    """Return training's standardised leave-one-out errors of each clip's coefficients (n, r3)."""
    pose, laid, model = trained.pose, trained.samples, trained.model
    left_out = kriging_model.leave_out(pose.hyper, laid.points, laid.groups)
    sigmas = np.sqrt(model.bank.sill * pose.variances * len(laid.points))
    return left_out @ model.decoder.reduced.bases[2] / sigmas[:, None]


def gap(found, trained) -> float:
    """Return the distance of a spread's covariance from training's, as a share of the latter."""
    # Training has degrees of freedom before frames.
    core = trained.model.decoder.reduced.core.swapaxes(0, 1)
    rows = strays(trained) @ core.reshape(-1, found[1]).T
    expected = rows.T @ rows
    own = found[0].residuals @ found[0].residuals.T
    return float(np.linalg.norm(own - expected) / np.linalg.norm(expected))


def test_coefficients_are_read_off_the_weights_of_the_file(labelled, labelled_exported):
    """The file holds its samples in an order of its own."""
    opened = session.open_bytes(labelled_exported.content, "labelled.onnx")
    weights = onnx_file.initializers(opened.content)
    samples = opened.kriging_weights.samples
    found = reduced_motion.sample_coefficients(opened.card, weights, samples)
    bases = labelled.model.decoder.reduced.bases[2]
    order = reduced_motion.importance_order(opened.card, weights, samples)
    assert np.abs(found - bases).max() < 1e-5
    assert not np.array_equal(order, np.arange(len(order)))
    # Negative control: in the order of the file they are other clips'.
    assert np.abs(found[order] - bases).max() > 1e-2


def read(content):
    """Spread of a file's finest level, and its rank of samples."""
    own = gauss_newton.build_corrector(session.open_bytes(content, "x.onnx"), 0)
    return own.spread, own.reduced.core.shape[2]


def test_residuals_have_the_covariance_of_training(labelled, labelled_exported):
    found = read(labelled_exported.content)
    assert gap(found, labelled) < 1e-3
    own = found[0]
    missed = (own.captured - own.predicted) / own.sigmas[:, None]
    expected = own.residuals @ own.residuals.T
    assert np.abs(missed.T @ missed - expected).max() < 1e-6 * np.abs(expected).max()
    # Negative control: residuals of clips in another order have another.
    mixed = (own.captured - own.predicted[::-1]) / own.sigmas[:, None]
    assert np.abs(mixed.T @ mixed - expected).max() > 0.1 * np.abs(expected).max()


def test_the_metric_is_a_covariance(walking, rng):
    own, size = walking.bench.spread, walking.held.scene.numbers
    full = own.apply_shrunk(np.eye(size))
    assert np.abs(full - full.T).max() < 1e-12 * np.abs(full).max()
    assert np.linalg.eigvalsh(full).min() > -1e-12 * np.abs(full).max()
    gradients = rng.standard_normal((2, size))
    assert np.allclose(own.apply_shrunk(gradients), full @ gradients.T)
    # Shrinking keeps the size of it all.
    inner = own.residuals @ own.residuals.T
    kept = np.trace(full) - np.trace(own.cycle)
    assert kept == pytest.approx(np.trace(inner))
