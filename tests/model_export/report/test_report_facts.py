"""Tests of the report's figures: those of the training, as standard JSON."""

import json
from dataclasses import replace

import numpy as np
import pytest

from posefield.motion.measures import Measure
from posefield_train.align.warp import FIT_TIMES
from posefield_train.kriging import variogram
from posefield_train.kriging.kriging_bank import VARIANCE
from posefield_train.report import (
    calibration,
    clip_errors,
    coverage,
    spectra,
    truncation,
    variograms,
    warps,
)
from posefield_train.report.calibration import Calibration
from posefield_train.report.drawing import left_out_clips, significant_digits
from posefield_train.report.reliability import Reliability
from posefield_train.report.warps import TimeWarps

# JSON holds six digits.
DIGITS = 1e-5


def refuse(constant):
    raise ValueError(f"{constant} is not JSON")


@pytest.fixture(scope="module")
def facts(rendered):
    return json.loads(rendered.json, parse_constant=refuse)


@pytest.fixture(scope="module")
def controls(exported):
    return exported.card.controls


def test_the_numbers_are_those_of_the_card(facts, exported, trained, steps):
    about, card = facts["about"], exported.card
    assert about["provenance"] == card.provenance and about["diagnostics"] == card.diagnostics
    assert about["bytes"] == len(exported.content)
    assert about["steps"] == [{"step": s.name, "seconds": s.seconds} for s in steps]
    assert facts["sizes"]["chosen"]["ranks"] == list(card.levels[0].ranks)
    explained = {name: own["explained"] for name, own in facts["fields"].items()}
    assert explained == pytest.approx(trained.explained, rel=DIGITS)
    assert facts["clips"]["rms_m"] == pytest.approx(card.diagnostics["leave_one_out_rms_m"], 1e-3)


def test_times_are_not_in_the_model(exported):
    assert b"seconds" not in exported.content
    assert b"provenance" in exported.content


def test_every_clip_is_there_the_worst_first(facts, trained):
    found = [clip["missed_m"] for clip in facts["clips"]["clips"]]
    assert found == pytest.approx(
        sorted(np.sqrt(trained.left_out_errors), reverse=True), rel=DIGITS
    )
    worst = trained.examples[int(np.argmax(trained.left_out_errors))]
    assert facts["clips"]["clips"][0]["clip"] == left_out_clips.clip_label(worst)
    assert facts["clips"]["clips"][0]["performer"] == worst.row.performer
    assert facts["figures"]["worst"][0]["clip"] == left_out_clips.clip_label(worst)


def test_performers_add_up_to_all_clips(trained, controls):
    found = clip_errors.collect_clip_errors(trained, controls)
    counts, means = np.array(list(found.by_performer.values())).T
    assert counts.sum() == len(trained.left_out_errors) and np.all(np.diff(means) <= 0.0)
    assert counts @ means**2 == pytest.approx(trained.left_out_errors.sum())
    assert counts @ means**2 != pytest.approx(len(counts) * trained.left_out_errors.mean())


def test_spectra_add_up_to_the_tensor(trained):
    total = trained.tensor.rms(np.sum(np.square(trained.tensor.values))) ** 2
    for carried in spectra.measure_spectra(trained).carried:
        assert np.sum(np.square(carried)) == pytest.approx(total)
        assert np.sum(np.square(carried[1:])) != pytest.approx(total)


def test_the_error_of_the_chosen_size_is_that_of_the_model(trained):
    found = truncation.measure_truncation(trained)
    gap = trained.tensor.values - trained.model.decoder.reduced.restored()
    first, *others = found.chosen
    error = found.error(found.chosen)
    assert error == pytest.approx(float(trained.tensor.rms(np.sum(gap**2))))
    assert found.error((first - 1, *others)) != pytest.approx(error)


def test_no_smaller_size_has_as_little_error_as_the_chosen_one(trained):
    """It is chosen by true distances, and so not quite at the budget in the tensor's metric."""
    found = truncation.measure_truncation(trained)
    error = found.error(found.chosen)
    assert found.smallest(error) == found.chosen
    assert found.smallest(1.1 * error) != found.chosen


def test_nothing_lies_below_the_front(trained, rng):
    found = truncation.measure_truncation(trained)
    errors, marks = found.front()
    assert np.all(np.diff(errors) <= 0.0) and np.all(np.diff(marks) > 0.0)
    for flat in rng.integers(found.errors.size, size=200):
        error, stored = found.errors.ravel()[flat], found.stored.ravel()[flat]
        smaller = errors[marks >= stored]
        assert not len(smaller) or error >= smaller[0] - 1e-12
    # Negative control: a front of sizes half as large again would lie above some.
    numbers = found.numbers(found.chosen)
    assert found.error(found.chosen) < errors[marks >= numbers / 1.5][0]


def test_the_isotropic_variogram_is_that_of_scaled_controls(trained, controls):
    found = variograms.measure_variograms(trained, controls).directions[-1]
    hyper, points = trained.pose.hyper, trained.samples.half_ranges
    left = variogram.residuals(points, trained.values["pose"], max(hyper.drifts))
    expected = variogram.experimental_variogram(points * hyper.scales, left)
    shared = trained.tensor.weight * trained.tensor.values.shape[1]
    assert found.mean.distances == pytest.approx(expected.distances)
    assert found.mean.values == pytest.approx(expected.values / shared)
    assert len(found.distances) == len(points) * (len(points) - 1) // 2
    other = variogram.experimental_variogram(points, left)
    assert other.distances != pytest.approx(expected.distances)


def test_along_a_control_stand_pairs_that_go_along_it(trained, controls):
    found = variograms.measure_variograms(trained, controls).directions
    points = trained.samples.half_ranges
    for axis, direction in enumerate(found[:-1]):
        counted = 0
        for i in range(len(points)):
            for j in range(i):
                way = np.abs(points[i] - points[j])
                counted += bool(way[axis] ** 2 >= 0.5 * np.sum(way**2))
        assert len(direction.distances) == counted > 0
        assert direction.name == controls[axis].name


def test_a_control_of_three_values_has_too_few_lags_for_a_curve(trained, controls):
    found = {d.name: d for d in variograms.measure_variograms(trained, controls).directions}
    assert found["stature"].fit is None
    assert found["turn"].fit is not None and found["all controls"].fit is not None


def test_no_pairs_at_all_make_no_lags():
    none = variograms.by_lag(np.zeros(0), np.zeros(0))
    assert len(none.pairs) == len(none.values) == 0


def test_a_control_that_tells_performers_apart_is_said_so(trained, controls):
    found = coverage.measure_coverage(trained, controls)
    assert found.labels() == ("stature",)
    # Negative control: one value changed, and it is a measurement like any other.
    values = found.values.copy()
    values[0, 0] += 0.01
    assert replace(found, values=values).labels() == ()
    assert replace(found, performers=("",) * len(values)).labels() == ()


def test_trust_says_what_to_capture_and_which_joints_err(facts, exported):
    found = facts["trust"]
    card = exported.card
    assert found["measured"] == {}
    assert sorted(found["joint_sigma"].values()) == sorted(card.joint_sigma)
    assert set(found["joint_sigma"]) == set(card.skeleton.names)
    gains = [point["gain"] for point in found["suggestions"]]
    assert gains[0] == max(gains) and min(gains) > 0.0
    assert 0.0 < found["support_limit"] < 1.0
    hand = Measure("height", (card.skeleton.names.index("RightHand"),), "end")
    told = replace(card, controls=(replace(card.controls[0], measure=hand), *card.controls[1:]))
    held = Reliability(told, 0.5, ())
    assert held.measured == {card.controls[0].name: "height of RightHand at end"}
    assert "RightHand" in held.section().paragraphs[0]
    assert "RightHand" not in Reliability(card, 0.5, ()).section().paragraphs[0]


def test_coverage_says_where_nothing_is(facts, trained):
    for own, column in zip(
        facts["coverage"]["controls"],
        np.array([e.controls for e in trained.examples]).T,
        strict=True,
    ):
        low, high = own["widest_gap"]
        ordered = np.unique(column)
        assert high - low == pytest.approx(np.diff(ordered).max(), rel=1e-3)
        assert own["distinct"] == len(ordered)


def test_the_largest_stretch_is_that_of_the_slope_or_its_inverse():
    knees = np.array([0.0, 0.5, 1.0])
    maps = np.stack(
        [np.interp(FIT_TIMES, knees, [0.0, middle, 1.0]) for middle in (0.5, 0.25, 0.9)]
    )
    found = TimeWarps(maps, ("even", "slow first", "fast first"), np.ones(3), np.zeros(3))
    assert found.stretches == pytest.approx([1.0, 2.0, 5.0])
    assert found.change_times[1] == 0.0 and found.change_times[2] == pytest.approx(0.5)
    assert found.at_limit.tolist() == [False, False, False]
    steep = np.interp(FIT_TIMES, knees, [0.0, 0.95, 1.0])[None]
    assert TimeWarps(steep, ("steep",), np.ones(1), np.zeros(1)).at_limit.tolist() == [True]
    named = [clip["clip"] for clip in found.facts()["clips"]]
    assert named == ["fast first", "slow first", "even"]


def test_warps_lead_from_start_to_end(trained):
    found = warps.collect_warps(trained)
    assert np.abs(found.maps[:, [0, -1]] - [0.0, 1.0]).max() < 1e-12
    assert np.all(found.stretches >= 1.0)


def test_sigma_is_right_on_average_by_construction(trained):
    found = calibration.measure_calibration(trained)
    assert found.measures["mean_squared_ratio"] == pytest.approx(1.0)
    on_canonical_time = replace(found, actual=np.sqrt(trained.left_out_errors))
    assert on_canonical_time.measures["mean_squared_ratio"] > 1.2
    half = replace(found, predicted=0.5 * found.predicted)
    assert half.measures["mean_squared_ratio"] == pytest.approx(4.0)


def test_sigma_of_a_captured_point_is_the_graphs(trained):
    """Check that sigma is less at a known clip than where it is left out."""
    bank = trained.model.bank
    sigma = bank.sigma(bank.numpy(bank.pose.samples)[VARIANCE])
    assert np.all(sigma < calibration.measure_calibration(trained).predicted)


def test_calibration_measures(rng):
    predicted, actual = rng.uniform(1.0, 2.0, (2, 50))
    found = Calibration(predicted, actual).measures
    assert found["within_one_sigma"] == np.mean(actual <= predicted)
    assert -0.5 < found["rank_correlation"] < 0.5
    assert Calibration(predicted, predicted**3).measures["rank_correlation"] == pytest.approx(1.0)
    opposite = Calibration(predicted, 1.0 / predicted)
    assert opposite.measures["rank_correlation"] == pytest.approx(-1.0)
    assert Calibration(np.ones(50), actual).measures["rank_correlation"] == 0.0


def test_clips_of_equal_distance_keep_their_order(trained, controls):
    even = replace(trained, left_out_errors=np.ones_like(trained.left_out_errors))
    assert clip_errors.collect_clip_errors(even, controls).indices == tuple(
        range(len(trained.left_out_errors))
    )


def test_numbers_are_rounded_to_six_digits():
    assert significant_digits.round_numbers(np.array([[1 / 3, 1e-9 / 3]])) == [
        [0.333333, 3.33333e-10]
    ]
