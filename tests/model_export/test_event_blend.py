"""Tests of the blend of a second prediction around the event, and of the model that gives it."""

from dataclasses import replace

import numpy as np
import pytest

from posefield.inference import reduced_motion
from posefield.model_file import onnx_file
from posefield_train.adapt import model_reconstruction
from posefield_train.graph import onnx_export
from posefield_train.kriging import coefficient_models, universal_kriging
from posefield_train.kriging.kriging_bank import POSE
from posefield_train.tensor import truncation_error
from posefield_train.tensor.decoder import (
    COEFFICIENTS,
    LOST_SHARE,
    build_blend,
    event_jacobians,
    event_weights,
)


@pytest.fixture(scope="module")
def judge(small_recipe, trained):
    return truncation_error.truncation_reference(small_recipe, trained.examples, trained.tensor)


@pytest.fixture(scope="module")
def blended(judge, trained):
    """The small model with a second prediction of five coefficients, whether it pays or not."""
    model = trained.model
    reduced, frames = model.decoder.reduced, len(model.decoder.reduced.bases[1])
    weights = event_weights(frames, judge.event_frame.frame, cyclic=False)
    blend = build_blend(5, weights, reduced.core, reduced.bases[1])
    hyper = replace(model.bank.pose.hyper, nugget=0.5, trend=300.0)
    event = universal_kriging.solve(hyper, model.bank.pose.samples, reduced.bases[2][:, :5])
    bank = replace(model.bank, event=event)
    decoder = replace(model.decoder, event=blend)
    return replace(trained, model=replace(model, bank=bank, decoder=decoder))


def test_the_core_blends_two_predictions_by_the_weights(blended):
    """(1 - w) M a + w M b = M (a + w (b - a)), frame by frame."""
    decoder, (_, _, r3) = blended.model.decoder, blended.model.decoder.reduced.core.shape
    rng = np.random.Generator(np.random.PCG64(1))
    first = rng.normal(size=(4, r3))
    second = first.copy()
    second[:, :5] += rng.normal(size=(4, 5))
    frames = np.arange(len(decoder.reduced.bases[1]), dtype=float)
    place = np.tile(frames, (4, 1))
    both = np.hstack([first, second[:, :5] - first[:, :5]])
    found = decoder.reduced_poses(both, place)
    plain = replace(decoder, event=None)
    before, after = (plain.reduced_poses(own, place) for own in (first, second))
    share = decoder.event.weights[:, None]
    expected = (1.0 - share) * before + share * after
    moved = np.linalg.norm(after - before)
    assert np.linalg.norm(found - expected) < 2.0 * np.sqrt(LOST_SHARE) * moved
    assert np.linalg.norm(before - expected) > 0.1 * moved, "negative control: no blend"
    assert np.linalg.norm(after - expected) > 0.1 * moved, "negative control: the second alone"


def test_the_graph_and_the_service_read_the_same_blend(blended, small_recipe, exported):
    made = onnx_export.export_model(blended)
    assert made.parity < 1e-5, "of the joints, at random inputs of all levels"
    finest, *coarse = made.card.levels
    assert finest.event == 5 and {level.event for level in coarse} == {0}
    assert {level.event for level in exported.card.levels[1:]} == {0}
    held = reduced_motion.read(onnx_file.initializers(made.content), finest, made.card)
    core, times = blended.model.decoder.blended
    assert np.abs(held.core - core.transpose(1, 0, 2)).max() < 1e-6 * np.abs(core).max()
    assert np.abs(held.time - times).max() < 1e-6
    again = model_reconstruction.reconstruct(made.content, "small.onnx").adaptable.model
    controls = np.array([example.controls for example in blended.examples[:6]]) + 0.01
    labels = np.zeros((6, 0))
    expected, found = (model.fields(controls, labels, 0)[POSE] for model in (blended.model, again))
    scale = np.abs(expected).max()
    # The order of samples differs, and all was stored in float32.
    assert np.abs(np.abs(found) - np.abs(expected)).max() < 1e-3 * scale
    assert expected.shape[1] == finest.ranks[2] + 5


def test_the_second_model_is_used_where_it_is_clearly_better(judge, trained, small_recipe):
    full, pose = trained.full, trained.pose
    same = coefficient_models.compare_models(judge, full, judge.event_frame, (pose, pose))
    assert same.pose == same.event and not same.is_used
    perfect = replace(pose, residuals=0.0 * pose.residuals)
    better = coefficient_models.compare_models(judge, full, judge.event_frame, (pose, perfect))
    assert better.event < 0.7 * better.pose == 0.7 * same.pose and better.is_used
    swapped = coefficient_models.compare_models(judge, full, judge.event_frame, (perfect, pose))
    assert not swapped.is_used


def at_event(judge, full, motions):
    """Positions (N, 3) of the event's joint by forward kinematics of whole motions."""
    whole = truncation_error.positions(
        judge.tensor, full.slices(motions), judge.parents, judge.offsets
    )
    return whole[:, judge.event_frame.frame, judge.event_frame.joint]


def test_jacobian_is_that_of_central_differences_of_forward_kinematics(judge, trained):
    full, event = trained.full, judge.event_frame
    found = event_jacobians(judge, full, event)
    assert found.shape == (len(trained.examples), 3, COEFFICIENTS)
    step = 1e-3 * full.motions[:, 0].std()
    for column in (0, 3, COEFFICIENTS - 1):
        either = [full.motions.copy() for _ in range(2)]
        either[0][:, column] += step
        either[1][:, column] -= step
        after, before = (at_event(judge, full, own) for own in either)
        expected = (after - before) / (2.0 * step)
        # Forward differences of 2 % of a deviation: the curvature's share is left.
        assert np.abs(found[:, :, column] - expected).max() < 0.03 * np.abs(expected).max()
        other = found[:, :, (column + 1) % COEFFICIENTS]
        assert np.abs(other - expected).max() > 0.3 * np.abs(expected).max()
