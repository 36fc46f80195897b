"""Tests of the evaluation of the results pages on 12 clips: every method, targets, performers."""

import json
from dataclasses import replace

import numpy as np
import pytest
from evaluation import ground_truth, new_performers, protocol
from evaluation.methods import ADAPTATION_COUNTS, ASKED_OPEN, EXACT, NO_PERFORMER, OPEN
from joblib import parallel_config
from minimal import plain_recipe, small_clip, write_clips

from posefield_train.evaluate.predictions import OURS
from posefield_train.jobs import ProcessJobs
from posefield_train.source import ingest
from posefield_train.source.recipe import Recipe

CLIPS = 12
JOBS = ProcessJobs(1)


@pytest.fixture(scope="module", autouse=True)
def _sequential():
    with parallel_config(backend="sequential"):
        yield


@pytest.fixture(scope="module")
def recipe():
    plain = plain_recipe()
    plain["clips"]["performer"] = "who"
    plain["kriging"] = {"label": "performer", "covariance": "matern52", "drift": 1}
    plain["event"] = {"joint": "LeftHand", "at": "end"}
    return Recipe.model_validate(plain)


@pytest.fixture(scope="module")
def family(recipe, tmp_path_factory):
    """Small motions of three performers, who swing their arms unlike each other."""
    rng = np.random.Generator(np.random.PCG64(3))
    clips = [
        small_clip(0.4 * np.sin(0.5 * i) + 0.5 * (i % 3) + 0.02 * rng.standard_normal(), 21 + i)
        for i in range(CLIPS)
    ]
    path = write_clips(tmp_path_factory.mktemp("eval") / "small", clips)
    rows = [f"{i}.bvh,{i},{'abc'[i % 3]}" for i in range(CLIPS)]
    (path / "clips.csv").write_text("\n".join(["file,v,who", *rows]) + "\n")
    return ingest.ingest(recipe, path)[0]


@pytest.fixture(scope="module")
def results(recipe, family):
    return [
        protocol.run(recipe, family, name, JOBS, lambda *_: None) for name in ("clip", "performer")
    ]


@pytest.mark.system
def test_methods_targets_and_performers_of_held_out_clips(results):
    clips, performers = results
    assert {OURS, EXACT, NO_PERFORMER, ASKED_OPEN, "naive", "gp", "mean"} <= set(
        clips.errors.errors
    )
    assert set(ADAPTATION_COUNTS) <= set(performers.errors.errors)
    assert {name + OPEN for name in ("naive", "gp", "thin_plate")} <= set(clips.errors.errors)
    for result in results:
        assert len(result.corrections) == CLIPS
        far = {
            name: max(error.effector for error in result.errors.of(name)) for name in (OURS, EXACT)
        }
        # Unless a captured position is reported as out of reach, all are met.
        assert all(c.reached for c in result.corrections) == (far[EXACT] < 1e-4)
        assert far[OURS] > 0.005
        # Arms of the small skeleton are shorter than a metre.
        assert not any(c.far.reached for c in result.corrections)
        assert all(c.beyond == tuple(sorted(c.beyond, reverse=True)) for c in result.corrections)
    facts = clips.facts()
    exact = facts["methods"][EXACT]["exact"]
    assert exact["steps_worst"] == max(c.steps for c in clips.corrections)
    assert exact["far_out_of_reach"] == 1.0
    assert set(facts["equal_information"]) == {"known", "open"}
    # Rows without the performer are compared with posefield's own without the performer.
    open_row, unnamed = facts["methods"]["gp" + OPEN], facts["methods"][NO_PERFORMER]
    difference = open_row["relative_cm"] - unnamed["relative_cm"]
    assert open_row["difference_cm"] == pytest.approx(difference, abs=1e-4)
    json.dumps(facts, allow_nan=False)


@pytest.mark.system
def test_a_name_and_clips_of_the_performer_reduce_the_error(results):
    clips, performers = (result.errors for result in results)
    facts = new_performers.facts([clips, performers])
    one, three = (facts[f"posefield_adapt_{count}"] for count in (1, 3))
    assert facts["named_nearer"] > 0.0
    assert three["relative_cm"] < one["relative_cm"] < three["shown_none_cm"]
    assert three["clips"] == CLIPS
    ours = np.mean([error.relative.mean for error in clips.errors[OURS]])
    assert three["shown_all_cm"] == pytest.approx(100 * ours, rel=1e-5)
    assert new_performers.facts([clips]) == {}


def test_clips_to_adapt_with_are_far_apart_and_never_of_the_asked_recording(family):
    held = [replace(e, recording=f"recording {i // 2}") for i, e in enumerate(family)]
    for asked in range(CLIPS):
        shown = new_performers.choose_clips(held, asked, 5)
        recordings = [i // 2 for i in shown]
        assert len(shown) == 5 == len(set(recordings)) and asked // 2 not in recordings
        three = new_performers.choose_clips(held, asked, 3)
        assert set(three) <= set(shown)
        assert np.ptp([held[i].controls[0] for i in three]) >= 7
    assert len(new_performers.choose_clips(held, 0, 20)) == CLIPS // 2 - 1


@pytest.mark.system
def test_the_truth_is_nearer_to_a_model_than_to_the_mean(small_recipe, examples):
    points = ground_truth.truth_points(6)
    assert np.array_equal(points, ground_truth.truth_points(200)[:6])
    result = protocol.run_against_truth(small_recipe, examples[::2], points, JOBS, lambda *_: None)
    means = {name: own["relative_cm"] for name, own in result.facts()["methods"].items()}
    assert means[OURS] < 0.5 * means["mean"]
    assert means[OURS] < means["nearest"]
