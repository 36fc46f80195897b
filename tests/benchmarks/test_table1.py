"""Tests of Table 1: its error measure, its ranks, and its text with all definitions."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from paper import errors, markdown, measurement, precomputation, table1

from posefield_train.graph import truncation_cost
from posefield_train.tensor import truncation_error

SCRIPT = Path(__file__).parents[2] / "benchmarks/paper/table1.py"

# Compiling the kernels and measuring takes longer than a unit test may.
pytestmark = pytest.mark.system


@pytest.fixture(scope="module")
def over(made):
    return errors.uniform(made, 30)


@pytest.fixture(scope="module")
def measured(made):
    return measurement.of(made, points=30, rounds=1)


def test_distances_are_summed_over_joints_and_frames():
    found, expected = np.zeros((2, 4, 5, 3)), np.zeros((2, 4, 5, 3))
    found[0] = [3.0, 4.0, 0.0]
    assert errors.between(found, expected) == pytest.approx(np.sqrt(100.0**2 / 2))
    assert errors.between(found, found) == 0.0


def test_full_rank_has_no_error_and_fewer_ranks_have_more(over, made):
    full = made.trained.full
    found = [over.truncation(full.truncated(ranks)) for ranks in ((94, 40, 46), (20, 8, 20))]
    assert found[0] < 1e-9 < 0.1 < found[1]


def test_at_the_samples_without_nugget_the_motions_are_the_clips(over, made, small_recipe):
    """With mean bones for all, as Table 1 has them."""
    at_samples = replace(over, points=made.samples, hyper=replace(over.hyper, nugget=0.0))
    judge = truncation_error.truncation_reference(small_recipe, made.examples, made.trained.tensor)
    bones = np.broadcast_to(made.offsets.mean(axis=0), made.offsets.shape)
    clips = truncation_error.positions(
        judge.own_tensor, judge.own_tensor.values, judge.parents, np.array(bones)
    )
    assert np.abs(at_samples.whole - clips).max() < 1e-6
    assert np.abs(replace(over, points=made.samples).whole - clips).max() > 1e-3


@pytest.mark.parametrize("threshold", [8.0, 3.0])
def test_smallest_tensor_keeps_the_threshold_and_is_not_wasteful(over, made, threshold):
    full = made.trained.full
    found = errors.smallest(over, threshold)
    assert 0.8 * threshold < over.truncation(full.truncated(found)) <= threshold
    for mode in range(3):
        fewer = tuple(rank - 2 * (axis == mode) for axis, rank in enumerate(found))
        assert over.truncation(full.truncated(fewer)) > threshold


def test_precomputation_is_the_models_own(made):
    reduced, field = precomputation.ours(made, (12, 5, 10))
    expected = made.trained.full.truncated((12, 5, 10))
    assert np.abs(reduced.core - expected.core).max() < 1e-9
    assert np.abs(field.predict(made.samples[:3]) - reduced.bases[2][:3]).max() < 0.2
    assert len(set(field.hyper.scales)) == 1, "isotropic, by the variogram"


def test_every_size_says_what_it_costs(measured, made):
    named = {size.asked: size for size in measured.sizes}
    assert set(named) == {
        *measurement.THRESHOLDS,
        *(f"the paper's {'×'.join(map(str, ranks))}" for ranks in measurement.PAPER_RANKS),
    }
    for asked, limit in measurement.THRESHOLDS.items():
        size = named[asked]
        assert size.error <= limit
        compression = truncation_cost.tensor_compression(made.trained.tensor, size.ranks, 4)
        assert (size.core, size.stored) == (compression.core, compression.stored)
    assert named["500 cm"].core < named["1000 cm"].core
    assert all(size.from_naive > 0.5 * measured.full_from_naive for size in measured.sizes)


def test_every_baseline_is_compared_with_ours_at_the_papers_size(measured):
    shown = next(size for size in measured.sizes if size.ranks == measurement.SHOWN)
    assert {one.ours for one in measured.precompute} == {shown.precompute}
    assert {one.ours for one in measured.pose} == {shown.pose}
    for one in (*measured.precompute, *measured.pose):
        assert one.ratio == one.seconds / one.ours > 0.0


def test_text_holds_the_papers_figures_and_every_definition(measured):
    said = markdown.text(measured)
    for figure in ("119.8 s", "2.76 ms", "22 × 6 × 24 | 267 | 106", "18 × 6 × 28 | 280 |"):
        assert figure in said
    for one in (*measured.precompute, *measured.pose):
        assert one.words in said
    assert "thresholds have no unit" in said
    assert said.count("core alone at 500") == 2


def test_a_goal_that_is_missed_is_called_so(measured):
    slow = tuple(replace(one, seconds=0.5 * one.ours) for one in measured.precompute)
    fast = tuple(replace(one, seconds=500.0 * one.ours) for one in measured.precompute)
    assert markdown.text(replace(measured, precompute=slow)).count("| 20 | **no** |") == len(slow)
    assert markdown.text(replace(measured, precompute=fast)).count("| 20 | yes |") == len(fast)


def test_facts_are_plain(measured):
    facts = json.loads(json.dumps(table1.facts(measured)))
    assert facts["raw"] == [94, 40, 46]
    assert len(facts["sizes"]) == 7
    assert facts["pose"][0]["goal"] == 3.3


def test_the_script_runs_as_a_file_from_any_folder(tmp_path):
    command = [sys.executable, SCRIPT, "--help"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "--json" in done.stdout
