"""Tests of the feet of the service's answers for held-out clips."""

import numpy as np
import pytest

from posefield_train.evaluate.folds import Fold
from posefield_train.evaluate.footing import feet_summary, standing_answers
from posefield_train.graph import onnx_export
from posefield_train.sample import sample_walk
from posefield_train.train import train


def apart(made, captured):
    """Root mean square distance of joints at even shares of two clips, from the root, m."""
    paths = []
    for clip in (made, captured):
        positions = clip.positions() - clip.root_path[:, None]
        frames = np.linspace(0, len(clip) - 1, 40).round().astype(int)
        paths.append(positions[frames])
    return float(np.sqrt(np.mean(np.square(paths[0] - paths[1]))))


@pytest.fixture(scope="module")
def found(strides):
    """Answers for three strides by a model of the others."""
    rest, held = Fold((0, 1, 2)).split(strides)
    recipe = sample_walk.recipe()
    trained = train(recipe, rest, lambda _: None)
    file = onnx_export.export_finest(recipe, trained)
    return standing_answers.feet_answers(recipe.name, file, held, apart)


def test_standing_feet_slide_less_and_cost_little(found):
    assert len(found) == 3
    for own in found:
        assert own.standing.weighted_skate < own.predicted.weighted_skate + 1e-3
        assert own.standing_error < own.predicted_error + 0.01
        assert own.standing.lowest > -0.01
        assert 0.0 <= own.lowered <= 0.08


def test_feet_that_are_locked_without_swing_rules_slide_more(found):
    """Negative control: rules of swings, and not the contacts alone, make feet stand."""
    locked, standing = (
        np.mean([getattr(own, name).weighted_skate for own in found])
        for name in ("locked", "standing")
    )
    assert locked > standing


def test_facts_are_ratios_of_means_and_centimetres(found):
    told = feet_summary.facts(found)
    captured = sum(own.captured.acceleration for own in found)
    standing = sum(own.standing.acceleration for own in found)
    assert told["acceleration"]["standing"] == pytest.approx(standing / captured, rel=1e-5)
    errors = [own.standing_error for own in found]
    assert told["standing_error_cm"] == pytest.approx(100.0 * sum(errors) / 3.0, rel=1e-5)
    assert told["clips"] == 3


def test_the_table_has_a_row_for_each_measure(found):
    assert len(feet_summary.rows(found)) == len(feet_summary.RATIOS) + 3
    assert feet_summary.table([]) == "" and feet_summary.facts([]) == {}
