"""Tests of the takes of an evaluation: random fields, held-out clips, and their summary."""

from dataclasses import replace

import numpy as np
import pytest

from posefield.inference import session
from posefield.kriging.kriging_model import KrigingWeights
from posefield.question.motion_question import ClipQuestion
from posefield_train.evaluate.folds import Fold
from posefield_train.evaluate.variation import field_statistics, take_answers, take_summary
from posefield_train.evaluate.variation.take_summary import Takes
from posefield_train.graph import onnx_export
from posefield_train.sample import sample_walk
from posefield_train.train import train

HELD = (0, 1, 2)


@pytest.fixture(scope="module")
def file(strides):
    """A model of the strides but three."""
    rest, _ = Fold(HELD).split(strides)
    recipe = sample_walk.recipe()
    return onnx_export.export_finest(recipe, train(recipe, rest, lambda _: None))


@pytest.fixture(scope="module")
def found(strides, file):
    _, held = Fold(HELD).split(strides)
    return take_answers.take_results("stroll", file, held, HELD)


@pytest.fixture(scope="module")
def weights(file):
    return session.open_bytes(file, "stroll").kriging_weights


def test_fields_are_as_the_model_says_and_their_controls_are_not(weights):
    own = [field_statistics.measure(weights, seed) for seed in range(1, 7)]
    mean = {name: np.mean([getattr(each, name) for each in own], axis=0) for name in vars(own[0])}
    assert np.allclose(mean["variogram"], 1.0, atol=0.1)
    assert mean["variance"] == pytest.approx(1.0, abs=0.1)
    assert mean["mean_error"] < 1.3
    assert not np.allclose(mean["wrong_variogram"], 1.0, atol=0.1)
    assert mean["unconditioned"] > 1.3 and mean["shared_errors"] > 1.3


def test_other_folds_have_other_seeds(weights):
    first, again, other = (field_statistics.measure(weights, seed) for seed in (1, 1, 2))
    assert first == again != other


def test_a_covariance_without_fields_has_no_takes(weights):
    spherical = replace(weights.hyper, covariance="spherical")
    assert field_statistics.measure(KrigingWeights(spherical, weights.samples), 1) is None
    assert take_summary.facts(Takes()) == {} and take_summary.table(Takes()) == ""


def test_few_samples_have_takes_without_statistics_of_fields(weights, found):
    few = KrigingWeights(weights.hyper, weights.samples[:5])
    assert field_statistics.measure(few, 1) is None
    assert field_statistics.measure(KrigingWeights(weights.hyper, weights.samples[:6]), 1)
    alone = Takes(found.clips)
    assert "variance" not in take_summary.facts(alone)
    assert len(take_summary.rows(alone)) == 3


def test_takes_of_held_out_clips_are_measured_at_the_default_rate(found):
    assert ClipQuestion(controls={}).fps == take_answers.RATE
    assert len(found.clips) == len(HELD)
    for own in found.clips:
        assert own.take != own.predicted and own.sliding != own.predicted
        assert own.take.weighted_skate < own.sliding.weighted_skate + 1e-3
        # All time functions of a cycle vary, and this model has no detail.
        assert own.unlimited is own.detailed is own.detailed_take is None


def test_a_take_of_a_motion_without_cycle_varies_few_time_functions(labelled_path, examples):
    made = take_answers.take_results("reach", labelled_path.read_bytes(), examples[:2], (0, 1))
    # Without feet no motion is measured.
    assert made.clips == () and made.fields is not None
    told = take_summary.facts(take_summary.merge([made], []))
    assert "acceleration" not in told and told["variance"] == pytest.approx(1.0, abs=0.2)


def test_facts_are_ratios_of_means_in_the_order_of_the_clips(found):
    told = take_summary.facts(take_summary.merge([found, None], [2, 0, 1]))
    captured = sum(own.captured.acceleration for own in found.clips)
    taken = sum(own.take.acceleration for own in found.clips)
    assert told["acceleration"]["take"] == pytest.approx(taken / captured, rel=1e-5)
    assert told["clips"] == 3 and told["frames_per_second"] == take_answers.RATE
    merged = take_summary.merge([found], [2, 0, 1])
    assert merged.clips[0] is found.clips[2]
    assert take_summary.merge([found], [0, 1]).clips == (), "a fold without takes"


def test_the_table_has_values_beside_negative_controls(found):
    merged = take_summary.merge([found], [0, 1, 2])
    listed = take_summary.rows(merged)
    assert len(listed) == 6 and all(len(row) == len(take_summary.HEADER) for row in listed)
    # With detail there is a row of it.
    one = replace(found.clips[0], detailed=found.clips[0].take, detailed_take=found.clips[0].take)
    detailed = replace(merged, clips=[one, *found.clips[1:]])
    rows = [row for row in take_summary.rows(detailed) if "detail" in row[0]]
    assert len(rows) == 1 and "without detail" in rows[0][2]
    assert "variance over kriging variance" in take_summary.table(merged)
