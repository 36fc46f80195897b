"""Tests of the report's figures: those of the training, as standard JSON."""

import json
from dataclasses import replace

import numpy as np
import pytest

from posefield.motion.measures import Measure
from posefield_train.align.warp import FIT_TIMES
from posefield_train.graph.trained_model import Outlier
from posefield_train.kriging.kriging_bank import VARIANCE
from posefield_train.report import clip_errors, tensor
from posefield_train.report import controls as sections
from posefield_train.report.tensor import TimeWarps

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
    assert about["steps"] == [{"step": name, "seconds": seconds} for name, seconds in steps]
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
    assert facts["clips"]["clips"][0]["clip"] == clip_errors.clip_label(worst)
    assert facts["clips"]["clips"][0]["performer"] == worst.row.performer
    assert facts["figures"]["worst"][0]["clip"] == clip_errors.clip_label(worst)


def test_performers_add_up_to_all_clips(trained):
    rows = clip_errors.errors_by_performer(trained)
    counts, means = np.array([(row["clips"], row["rms_m"]) for row in rows]).T
    assert counts.sum() == len(trained.left_out_errors) and np.all(np.diff(means) <= 0.0)
    assert counts @ means**2 == pytest.approx(trained.left_out_errors.sum())
    assert counts @ means**2 != pytest.approx(len(counts) * trained.left_out_errors.mean())


def test_the_chosen_size_has_the_models_error_and_no_smaller_one_has_as_little(trained):
    """It is chosen by true distances, and so not quite at the budget in the tensor's metric."""
    every = tensor.measure_truncation(trained)
    gap = trained.tensor.values - trained.model.decoder.reduced.restored()
    first, *others = every.chosen
    error = every.facts(every.chosen)["rms_m"]
    assert error == pytest.approx(float(trained.tensor.rms(np.sum(gap**2))))
    assert every.facts((first - 1, *others))["rms_m"] != pytest.approx(error)
    assert every.smallest(error) == every.chosen
    assert every.smallest(1.1 * error) != every.chosen


def test_a_control_with_one_value_a_performer_is_named(trained, controls):
    values = np.stack([example.controls for example in trained.examples])
    performers = [example.row.performer for example in trained.examples]
    assert sections.label_controls(controls, values, performers) == ("stature",)
    assert sections.label_controls(controls, values, [""] * len(values)) == ()
    # Negative control: one value changed, and it is a measurement like any other.
    values[0, 0] += 0.01
    assert sections.label_controls(controls, values, performers) == ()


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
    limits = sections.limits_section(told, 0.5, ())
    assert limits.facts["measured"] == {card.controls[0].name: "height of RightHand at end"}
    assert "RightHand" in limits.paragraphs[0]
    assert "RightHand" not in sections.limits_section(card, 0.5, ()).paragraphs[0]


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
    found = TimeWarps(maps)
    assert found.stretches == pytest.approx([1.0, 2.0, 5.0])
    assert found.change_times[1] == 0.0 and found.change_times[2] == pytest.approx(0.5)
    assert found.at_limit.tolist() == [False, False, False]
    steep = np.interp(FIT_TIMES, knees, [0.0, 0.95, 1.0])[None]
    assert TimeWarps(steep).at_limit.tolist() == [True]


def test_clips_are_listed_by_their_change_of_speed_with_the_shifts_of_cycles(trained):
    first, *others = trained.examples
    shifted = tensor.warp_section(
        replace(trained, examples=(replace(first, shift=-0.125), *others))
    )
    stretches = [clip["largest_stretch"] for clip in shifted.facts["clips"]]
    assert stretches == sorted(stretches, reverse=True) and stretches[-1] >= 1.0
    assert f"{clip_errors.clip_label(first)} by -12.5 %" in shifted.paragraphs[-1]
    assert {clip["shift"] for clip in shifted.facts["clips"]} == {0.0, -0.125}
    plain = tensor.warp_section(trained).paragraphs
    assert len(plain) == len(shifted.paragraphs) - 1


def test_sigma_is_right_on_average_by_construction(trained):
    facts = sections.calibration_section(trained).facts
    assert facts["mean_squared_ratio"] == pytest.approx(1.0)
    predicted, left_out = facts["predicted_m"], np.sqrt(trained.left_out_errors)
    on_canonical_time = sections.calibration_statistics(predicted, left_out)
    assert on_canonical_time["mean_squared_ratio"] > 1.2
    half = sections.calibration_statistics(0.5 * predicted, facts["actual_m"])
    assert half["mean_squared_ratio"] == pytest.approx(4.0)
    # Sigma is less at a known clip than where it is left out.
    bank = trained.model.bank
    assert np.all(bank.sigma(bank.numpy(bank.pose.samples)[VARIANCE]) < predicted)


def test_an_outlier_is_listed_with_the_evidence(trained, controls):
    evidence = ("lies far away", "leaps")
    outliers = tuple(Outlier(3, "far", text) for text in evidence)
    odd = clip_errors.error_section(replace(trained, outliers=outliers), controls)
    first, chart = odd.tables[0], odd.charts[0]
    assert first.caption == "Possible outliers" and "Outlined" in chart.caption
    label = clip_errors.clip_label(trained.examples[3])
    assert first.rows == ((label, "lies far away; leaps"),)
    assert [clip["clip"] for clip in odd.facts["clips"] if clip["against"]] == [label]
    clean = clip_errors.error_section(trained, controls)
    assert clean.tables[0].caption == "Clips with the largest error"
    assert "Outlined" not in clean.charts[0].caption
