"""Tests of learning curves of suggested and random samples."""

import numpy as np
import pytest

from posefield.common.errors import RecipeError
from posefield_train.evaluate import learning_curves
from posefield_train.evaluate.learning_curves import CHANCE, SUGGESTED, Learning
from posefield_train.sample import sample_family, sample_files
from posefield_train.sample.sample_family import SampleTrial
from posefield_train.source import ingest, recipe

SIZES = (40, 60, 80, 100)


def curve(suggested, chance):
    """Two trials with such a mean, a millimetre off on either side."""
    rows = {SUGGESTED: np.array([suggested] * 2), CHANCE: np.array([chance] * 2)}
    return Learning(
        SIZES, {way: np.stack([row - 0.1, row + 0.1]) / 100 for way, row in rows.items()}
    )


def test_it_is_as_fast_as_it_comes_to_where_chance_ends():
    found = curve([4.0, 2.0, 1.5, 1.0], [4.0, 3.0, 2.5, 2.0])
    assert (found.equivalent_samples, found.speedup) == (pytest.approx(60.0), pytest.approx(3.0))
    between = curve([4.0, 2.5, 1.5, 1.0], [4.0, 3.0, 2.5, 2.0])
    assert (between.equivalent_samples, between.speedup) == (
        pytest.approx(70.0),
        pytest.approx(2.0),
    )


def test_random_samples_that_do_not_help_give_no_ratio():
    found = curve([4.0, 3.0, 2.0, 1.0], [4.0, 4.5, 4.5, 4.5])
    assert found.speedup is None and learning_curves.facts(found)["faster"] is None
    assert "nothing to compare with" in learning_curves.table(found)


def test_what_is_no_faster_and_what_is_slower_is_not_called_so():
    same = curve([4.0, 3.0, 2.5, 2.0], [4.0, 3.0, 2.5, 2.0])
    assert same.speedup == pytest.approx(1.0)
    assert curve([4.0, 3.5, 3.0, 2.5], [4.0, 3.0, 2.5, 2.0]).speedup == pytest.approx(1.0)


def test_it_is_told_as_a_table_and_as_figures():
    found = curve([4.0, 2.0, 1.5, 1.0], [4.0, 3.0, 2.5, 2.0])
    row = "| suggested, global   | 4.00 ± 0.10 | 2.00 ± 0.10 | 1.50 ± 0.10 | 1.00 ± 0.10 |"
    assert row in learning_curves.table(found)
    assert "3.0 times as fast" in learning_curves.table(found)
    facts = learning_curves.facts(found)
    assert facts["at_random"] == {
        "global_cm": [4, 3, 2.5, 2],
        "relative_cm": [4, 3, 2.5, 2],
        "global_standard_error_cm": [0.1] * 4,
    }
    assert facts["trials"] == 2
    assert facts["samples"] == list(SIZES)


def test_samples_of_a_trial_are_a_family_and_each_stature_is_a_performer(tmp_path):
    """Bodies differ with the stature, and one performer has one body."""
    rng = np.random.Generator(np.random.PCG64(1))
    points = [[stature, 0.8, turn, 1.1] for stature in (1.65, 1.85) for turn in range(5)]
    made = [learning_curves.noisy_sample(point, rng) for point in points]
    file = sample_files.write_family(tmp_path / "drawn", made)
    assert len(ingest.ingest(recipe.read(file), file.parent)[0]) == 10
    alike = [SampleTrial("somebody", each.controls, each.clip) for each in made]
    file = sample_files.write_family(tmp_path / "alike", alike)
    with pytest.raises(RecipeError, match="two performers under the name"):
        ingest.ingest(recipe.read(file), file.parent)


def test_samples_of_ones_own_are_a_family(tmp_path):
    chosen = list(sample_family.samples())[3:6]
    file = sample_files.write_family(tmp_path / "own", chosen)
    found, _ = ingest.ingest(recipe.read(file), file.parent)
    expected = [[*vars(sample.controls).values()] for sample in chosen]
    assert [example.controls.tolist() for example in found] == expected
