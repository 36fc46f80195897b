"""Tests of the statistics that takes are drawn from."""

from dataclasses import replace

import numpy as np
import pytest

from posefield_train.graph import onnx_export


@pytest.fixture(scope="module")
def stroll(models_trained):
    """A model of the procedural walk."""
    return models_trained.trained("stroll")


@pytest.fixture(scope="module")
def smooth(stroll):
    """The model with two time functions, which cannot follow all of the walk."""
    model, decoder = stroll.model, stroll.model.decoder
    few = decoder.reduced.truncated((decoder.reduced.core.shape[0], 2, 8))
    return replace(stroll, model=replace(model, decoder=replace(decoder, reduced=few)))


def test_the_joint_root_has_the_covariance_of_duration_and_travel(stroll, models_trained):
    rows = np.array(onnx_export.take_root(stroll))
    card = models_trained.exported("stroll").card
    beside = np.array(card.beside)
    assert rows.shape == (4, card.levels[0].ranks[2] + 4)
    expected = beside @ beside.T
    # Both are stored with four digits.
    assert np.allclose(rows @ rows.T, expected, rtol=0.0, atol=2e-3 * np.trace(expected))
    alone = rows[:, -4:]
    assert np.trace(alone @ alone.T) < 0.9 * np.trace(expected)
    assert card.making.take_root == onnx_export.take_root(stroll)


def test_detail_restores_the_acceleration_that_left_out_predictions_lack(smooth):
    found = onnx_export.fit_detail(smooth)
    assert found is not None
    assert found.without < 0.99 and found.sampled == pytest.approx(1.0, abs=0.003)
    assert found.deviations.shape == (19, 14) and (found.deviations >= 0.0).all()


def test_no_detail_is_stored_where_none_is_missing(stroll, models_trained):
    assert onnx_export.fit_detail(stroll) is None
    assert models_trained.exported("stroll").card.making.detail == b""


def test_motions_without_cycle_have_the_duration_of_repeats_alone(trained, models_trained):
    found = onnx_export.estimate(trained)
    assert found == onnx_export.TakeStatistics(duration=onnx_export.repeat_duration(trained))
    card = models_trained.exported("reaching").card
    assert found.on_card(card) == card
    assert "detail" not in card.diagnostics


@pytest.mark.parametrize("apart", [0.0, 10.0])
def test_durations_vary_as_those_of_repeats_and_not_as_those_of_other_controls(trained, apart):
    count = len(trained.examples)
    rng = np.random.Generator(np.random.PCG64(3))
    logarithms = rng.normal(0.0, 0.2, count)
    points = apart * np.arange(count)[:, None] * np.ones((1, trained.samples.points.shape[1]))
    known = replace(
        trained,
        samples=replace(trained.samples, points=points),
        aligned=replace(trained.aligned, durations=np.exp(logarithms)),
        residuals={"duration": np.full((count, 1), 0.3)},
    )
    expected = 0.3 if apart else logarithms.std(ddof=1)
    assert onnx_export.repeat_duration(known) == pytest.approx(expected, rel=0.02)


def test_cycles_have_no_duration_of_repeats(stroll):
    assert onnx_export.repeat_duration(stroll) == 0.0


def test_the_card_says_what_is_sampled(smooth, models_trained):
    card = onnx_export.estimate(smooth).on_card(models_trained.exported("stroll").card)
    facts = card.diagnostics["detail"]
    assert (facts["harmonics"], facts["directions"]) == (19, 14)
    assert facts["acceleration"] < facts["sampled"]
    assert len(card.making.detail) == 2 * 19 * 14
