"""Tests of the evaluation protocol: held-out clips do not influence their predictions."""

import json
import sys
from dataclasses import replace

import numpy as np
import pytest
from joblib import parallel_config
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from minimal import TOML, plain_recipe, small_clip, write_clips

from posefield import cli
from posefield.common.errors import TrainingError
from posefield.common.units import UP
from posefield_train.evaluate import (
    compared_motion,
    corrected_answers,
    corrections,
    folds,
    ground_truth,
    learning_curves,
    methods,
    motion_errors,
    new_performers,
    protocol,
)
from posefield_train.evaluate.methods import Queries
from posefield_train.evaluate.pages import evaluation_charts, evaluation_page
from posefield_train.evaluate.peers import interpolation_peers, predicted_values
from posefield_train.evaluate.peers.predicted_values import OPEN
from posefield_train.evaluate.summary import evaluation_summary, performer_summary
from posefield_train.parallel.jobs import ProcessJobs
from posefield_train.report.drawing import svg_chart
from posefield_train.source import ingest
from posefield_train.source.recipe import Recipe
from posefield_train.train import train

CLIPS = 12
# In this process: starting others takes longer, and other tests do.
JOBS = ProcessJobs(1)

LABELLED = TOML.replace('file = "file"\n', 'file = "file"\nperformer = "who"\n').replace(
    "[size]", '[kriging]\nlabel = "performer"\ncovariance = "matern52"\ndrift = 1\n[size]'
)


@pytest.fixture(scope="module", autouse=True)
def _sequential():
    """Run joblib's jobs here: starting its processes takes longer, and test_eval_cluster does."""
    with parallel_config(backend="sequential"):
        yield


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Small motions of three performers, who swing their arms unlike each other."""
    rng = np.random.Generator(np.random.PCG64(3))
    clips = [
        small_clip(0.4 * np.sin(0.5 * i) + 0.5 * (i % 3) + 0.02 * rng.standard_normal(), 21 + i)
        for i in range(CLIPS)
    ]
    path = write_clips(tmp_path_factory.mktemp("eval") / "small", clips)
    rows = [f"{i}.bvh,{i},{'abc'[i % 3]}" for i in range(CLIPS)]
    (path / "clips.csv").write_text("\n".join(["file,v,who", *rows]) + "\n")
    return path


@pytest.fixture(scope="module")
def recipe():
    plain = plain_recipe()
    plain["clips"]["performer"] = "who"
    # One model to fit instead of four to choose from.
    plain["kriging"] = {"label": "performer", "covariance": "matern52", "drift": 1}
    plain["event"] = {"joint": "LeftHand", "at": "end"}
    plain["motion"]["feet"] = ["LeftHand"]
    return Recipe.model_validate(plain)


@pytest.fixture(scope="module")
def family(recipe, folder):
    return ingest.ingest(recipe, folder)[0]


@pytest.fixture(scope="module")
def results(recipe, family):
    said = []
    found = [
        protocol.run_protocol(
            recipe, family, name, JOBS, lambda done, parts: said.append((done, parts))
        )
        for name in ("clip", "performer")
    ]
    return found, said


def test_every_clip_is_held_out_once_with_all_of_its_take(family):
    files = [replace(e, take="") for e in family]
    same = [
        replace(e, row=replace(e.row, place=family[i // 3].row.place)) for i, e in enumerate(files)
    ]
    stated = [replace(e, take=f"take {i // 3}") for i, e in enumerate(family)]
    for examples, parts in ((family, CLIPS), (files, CLIPS), (same, CLIPS // 3)):
        own = folds.clip_folds(examples)
        assert sorted(i for fold in own for i in fold.held) == list(range(CLIPS))
        assert len(own) == parts
        for fold in own:
            rest, held = fold.split(examples)
            assert not {e.row.place for e in rest} & {e.row.place for e in held}
    assert [fold.held for fold in folds.clip_folds(stated)] == [
        fold.held for fold in folds.clip_folds(same)
    ]


def test_one_take_cannot_be_held_out(family):
    with pytest.raises(TrainingError, match=r"all \d+ clips are of one take, expected two or more"):
        folds.clip_folds([replace(e, take="one") for e in family])


def test_many_takes_are_dealt_into_parts_of_whole_takes(family):
    def take(i):
        return replace(family[0].row, place=family[0].row.place.with_name(f"{i // 2:03}.bvh"))

    many = [replace(family[0], row=take(i), take="") for i in range(2 * folds.MANY + 6)]
    own = folds.clip_folds(many)
    assert len(own) == folds.PARTS
    assert sorted(i for fold in own for i in fold.held) == list(range(len(many)))
    assert all(set(fold.held) == {i ^ 1 for i in fold.held} for fold in own)


def test_performers_are_held_out_whole(family):
    assert [set(fold.held) for fold in folds.performer_folds(family)] == [
        set(range(first, CLIPS, 3)) for first in range(3)
    ]


def answers(recipe, family, held):
    """Everyone's joints for one clip that is held out."""
    rest = [example for i, example in enumerate(family) if i != held]
    trained = train(recipe, rest, lambda _: None)
    example = family[held]
    found = methods.predict_all(
        recipe, trained, Queries(example.controls[None], [example.row.labels])
    )
    return {name: motions[0].points for name, motions in found.motions.items()}


def test_a_clip_held_out_has_no_say_in_what_is_predicted_for_it(recipe, family, results):
    """The protocol's errors are those of a model that never saw the clip."""
    held = 4
    by_hand = answers(recipe, family, held)
    event = compared_motion.MotionEvent(recipe_joint(family), 1.0)
    true = compared_motion.motion_of_clip(family[held].clip, event)
    feet = (recipe_joint(family),)
    for name, points in by_hand.items():
        own = compared_motion.ComparedMotion(points, 1.0, None)
        expected = motion_errors.compare_motions(own, true, feet).relative.mean
        assert results[0][0].errors[name][held].relative.mean == pytest.approx(expected, abs=1e-9)
    # Negative control: a model that saw it comes nearer.
    trained = train(recipe, family, lambda _: None)
    asked = Queries(family[held].controls[None], [family[held].row.labels])
    seen = methods.predict_all(recipe, trained, asked).motions["thin_plate"][0]
    told = motion_errors.compare_motions(seen, true, feet).relative.mean
    assert told < 0.5 * results[0][0].errors["thin_plate"][held].relative.mean


def recipe_joint(family):
    return family[0].clip.skeleton.names.index("LeftHand")


def test_an_interpolator_restores_the_samples_with_their_timing(recipe, family):
    trained = train(recipe, family, lambda _: None)
    ordered = trained.examples
    asked = Queries(np.stack([e.controls for e in ordered]), [e.row.labels for e in ordered])
    found = methods.predict_all(recipe, trained, asked).motions["thin_plate"]
    event = compared_motion.MotionEvent(recipe_joint(family), 1.0)
    captured = [compared_motion.motion_of_clip(example.clip, event) for example in ordered]
    for own, true in zip(found, captured, strict=True):
        assert own.duration == pytest.approx(true.duration)

    def farthest(motions):
        pairs = zip(motions, captured, strict=True)
        return max(
            motion_errors.compare_motions(own, true, ()).plain_absolute.mean for own, true in pairs
        )

    # What is lost is resampling to 20 frames and back.
    assert farthest(found) < 0.005
    assert farthest(found[1:] + found[:1]) > 0.015


def test_all_methods_are_asked_the_same_clips(results):
    (clips, performers), _ = results
    told = {"naive", predicted_values.GP, *interpolation_peers.LINEAR_PEERS}
    peers = {*told, *(name + OPEN for name in told), predicted_values.SAME_PERFORMER}
    ours = {"posefield", "posefield_exact"}
    unnamed = {new_performers.NO_PERFORMER, new_performers.ASKED_OPEN}
    assert set(clips.errors) == {*ours, *peers, *unnamed}
    assert set(performers.errors) == {*ours, *peers, *new_performers.ADAPTATION_COUNTS}
    assert all(len(found) == CLIPS for r in (clips, performers) for found in r.errors.values())
    assert clips.protocol == "leave_one_clip_out"
    assert performers.protocol == "leave_one_performer_out"
    assert len(clips.sigma) == CLIPS


def test_what_is_held_to_the_captured_event_meets_it(results):
    for result in results[0]:
        assert len(result.corrections) == CLIPS
        far = {
            name: max(error.effector for error in result.errors[name])
            for name in (methods.OURS, methods.EXACT)
        }
        reached = [c.reached for c in result.corrections]
        # Without a captured clip that is told to be out of reach, all are met.
        assert all(reached) == (far[methods.EXACT] < 1e-4)
        assert far[methods.OURS] > 0.005


def test_places_a_metre_off_are_told_to_be_out_of_reach(results):
    """Arms of the small skeleton are shorter than that."""
    found = [c for result in results[0] for c in result.corrections]
    assert not any(c.far.reached for c in found)
    assert all(len(c.beyond) == len(corrected_answers.BEYOND_DISTANCES) for c in found)
    assert any(c.reached for c in found)
    assert all(c.beyond == tuple(sorted(c.beyond, reverse=True)) for c in found)


def test_ours_is_drawn_in_orange_however_it_is_asked(results):
    found, figure = evaluation_summary.summarize(results[0][1]), Figure()
    evaluation_charts.paint_bars(found, figure)
    orange = {
        one.name
        for one, bar in zip(found, figure.axes[0].patches, strict=True)
        if to_hex(bar.get_facecolor()) == to_hex(svg_chart.ORANGE)
    }
    assert orange == {methods.OURS, methods.EXACT, *new_performers.ADAPTATION_COUNTS} & {
        one.name for one in found
    }
    # Negative control: there are others, who are not.
    assert {methods.OURS, *new_performers.ADAPTATION_COUNTS} <= orange < {one.name for one in found}


def test_of_the_root_nothing_is_asked_that_lies_farther_from_it(recipe, family):
    event = recipe.event.model_copy(update={"joint": "Hips"})
    own = recipe.model_copy(update={"event": event})
    found = protocol.run_protocol(own, family, "performer", JOBS, lambda done, parts: None)
    assert all(c.beyond == () and c.far is None for c in found.corrections)
    facts = corrections.facts(found)
    assert all(np.isfinite(value) for value in facts.values())
    before, after = (
        evaluation_summary.facts(found)["methods"][n] for n in (methods.OURS, methods.EXACT)
    )
    assert after["effector_cm"] < 0.5 * before["effector_cm"]
    assert not any("far" in name or name.startswith("out_of_reach_") for name in facts)


def test_without_an_event_nothing_is_held(recipe, family):
    plain = recipe.model_copy(update={"event": None})
    found = protocol.run_protocol(plain, family, "performer", JOBS, lambda done, parts: None)
    assert found.corrections == ()
    assert methods.EXACT not in found.errors
    assert "exact" not in str(evaluation_summary.facts(found)["methods"].keys())
    assert len(corrections.rows(found)) == 0


def test_what_was_held_stands_in_table_and_json(results):
    (clips, _), _ = results
    told = evaluation_summary.facts(clips)["methods"]["posefield_exact"]["exact"]
    steps = [c.steps for c in clips.corrections]
    assert told["steps_worst"] == max(steps)
    assert told["steps"] == pytest.approx(np.mean(steps), abs=1e-3)
    assert f"| {np.mean(steps):.1f} " in corrections.table(clips)
    assert told["far_out_of_reach"] == 1.0


def test_an_unknown_performer_is_trusted_less(results):
    (clips, performers), _ = results
    assert performers.sigma.mean() > clips.sigma.mean()


def test_a_name_is_worth_something_and_so_are_clips(results):
    """Three clips say more than one, and a name than none; the figures are those of the rows."""
    (clips, performers), _ = results
    facts = performer_summary.performer_facts([clips, performers])
    one, three = (facts[f"posefield_adapt_{count}"] for count in (1, 3))
    assert facts["named_nearer"] > 0.0
    assert three["relative_cm"] < one["relative_cm"] < three["shown_none_cm"]
    assert three["clips"] == CLIPS
    ours = np.mean([error.relative.mean for error in clips.errors["posefield"]])
    assert three["shown_all_cm"] == pytest.approx(100 * ours, rel=1e-5)
    assert three["farther_than_all"] == pytest.approx(
        three["relative_cm"] / three["shown_all_cm"] - 1.0, abs=1e-4
    )
    assert (
        performer_summary.performer_facts([clips]) == {}
        and performer_summary.performer_text([performers]) == []
    )
    assert len(performer_summary.performer_text([clips, performers])) == 4


def test_clips_are_shown_as_far_apart_as_they_come_and_never_the_asked_ones_take(family):
    held = [replace(e, take=f"take {i // 2}") for i, e in enumerate(family)]
    for asked in range(CLIPS):
        shown = new_performers.choose_clips(held, asked, 5)
        takes = [i // 2 for i in shown]
        assert len(shown) == 5 == len(set(takes)) and asked // 2 not in takes
        three = new_performers.choose_clips(held, asked, 3)
        assert set(three) <= set(shown)
        controls = np.array([held[i].controls[0] for i in three])
        assert np.ptp(controls) >= 7
    # No more than there are other takes.
    assert len(new_performers.choose_clips(held, 0, 20)) == CLIPS // 2 - 1


def test_who_has_too_few_takes_is_shown_nobodys_clips(recipe, family):
    trained = train(recipe, family[:9], lambda _: None)
    few = [replace(e, row=replace(e.row, performer="z")) for e in family[9:]]
    assert new_performers.predict_adapted(recipe, trained, few) == {
        n: [None] * 3 for n in new_performers.ADAPTATION_COUNTS
    }
    # Negative control: of one take more, each clip is asked for.
    more = [replace(e, row=replace(e.row, performer="z")) for e in family[8:]]
    found = new_performers.predict_adapted(recipe, trained, more)
    assert all(len(m) == 4 and None not in m for m in found.values())


def test_clips_that_a_method_was_not_asked_for_are_counted_and_left_out_of_its_row(results):
    whole = results[0][1]
    some = [e if i > 2 else None for i, e in enumerate(whole.errors["posefield_adapt_3"])]
    result = replace(whole, errors={**whole.errors, "posefield_adapt_3": tuple(some)})
    row = next(
        one for one in evaluation_summary.summarize(result) if one.name == "posefield_adapt_3"
    )
    assert (row.clips, row.left_out) == (CLIPS - 3, 3)
    assert row.facts()["clips_left_out"] == 3
    assert f"| posefield_adapt_3 ({CLIPS - 3} clips) " in evaluation_summary.table(result)
    ours, own = (
        evaluation_summary.relative_distances(result.of(name, range(3, CLIPS)))
        for name in ("posefield", "posefield_adapt_3")
    )
    assert row.worse == pytest.approx(float(np.mean(own - ours)))
    # Negative control: beside all of ours it would be another figure.
    everyone = evaluation_summary.relative_distances(result.of("posefield", range(CLIPS)))
    assert row.worse != pytest.approx(float(own.mean() - everyone.mean()))


def test_progress_is_told(results):
    _, said = results
    assert said == [*((i + 1, CLIPS) for i in range(CLIPS)), (1, 3), (2, 3), (3, 3)]


class Backwards:
    """Jobs whose results come as they finished, and when run again, in the reverse order."""

    results = None

    def run(self, function, arguments, shared=()):
        if self.results:
            return reversed(self.results)
        self.results = list(JOBS.run(function, arguments, shared))
        return iter(self.results)


def test_the_order_in_which_jobs_finish_changes_nothing(recipe, family):
    # Without the last clip a single performer is left, and methods that need two do not run.
    plain = recipe.model_copy(update={"event": None})
    named = [replace(e, row=replace(e.row, performer="aaab"[i])) for i, e in enumerate(family[:4])]
    jobs = Backwards()
    found, backwards = (
        protocol.run_protocol(plain, named, "clip", jobs, lambda done, parts: None)
        for _ in range(2)
    )
    assert any(None in own for own in found.errors.values())
    # Text, as a NaN is not equal to itself; the order of the methods counts too.
    assert str(evaluation_summary.facts(found)) == str(evaluation_summary.facts(backwards))
    assert np.array_equal(found.joint_sigma, backwards.joint_sigma)


def test_without_labels_rows_that_would_repeat_others_are_left_out(recipe, family):
    plain = recipe.model_copy(update={"kriging": recipe.kriging.model_copy(update={"label": []})})
    trained = train(plain, family, lambda _: None)
    found = methods.predict_all(plain, trained, Queries(family[0].controls[None], [{}])).motions
    assert predicted_values.SAME_PERFORMER not in found
    assert not [name for name in found if name.endswith(OPEN)]
    assert {"gp", "nearest"} <= set(found)


def test_what_cannot_be_trained_is_named(recipe, family):
    few = family[:4]
    with pytest.raises(TrainingError, match=r"held out: 2 samples, expected at least 3"):
        protocol.run_protocol(recipe, few, "performer", JOBS, lambda done, parts: None)


def test_a_line_that_hangs_on_one_clip_cannot_be_compared(family):
    names, lonely = ("v",), [replace(e, controls=np.zeros(1)) for e in family[:5]]
    lonely[3] = replace(lonely[3], controls=np.ones(1))
    line = lonely[3].row.line
    with pytest.raises(TrainingError, match=f"without the clip of line {line} .* fit a line"):
        methods.check_lines(lonely, names)
    lonely[1] = replace(lonely[1], controls=np.ones(1))
    methods.check_lines(lonely, names)


def test_a_recipe_says_what_can_be_asked(recipe, family):
    assert protocol.protocols(recipe, family) == ["clip", "performer"]
    alone = [replace(e, row=replace(e.row, performer="a")) for e in family]
    assert protocol.protocols(recipe, alone) == ["clip"]
    known = recipe.model_copy(update={"truth": "reaching"})
    assert protocol.protocols(known, alone) == ["truth", "clip"]


def test_errors_of_a_cycle_are_those_to_the_open_one(recipe, family):
    """A prediction is compared with the captured cycle, before its seam was closed."""
    away = [
        replace(e, captured=replace(e.clip, translations=e.clip.translations + UP))
        for e in family[:6]
    ]
    plain = recipe.model_copy(update={"event": None})
    fold = folds.Fold((2,))
    closed, opened = (
        protocol.run_fold(plain, own, fold, "clip").errors["mean"][0] for own in (family[:6], away)
    )
    assert abs(opened.absolute.mean - closed.absolute.mean) > 0.3
    assert opened.duration == closed.duration


def test_facts_are_what_was_measured(results):
    result = results[0][0]
    facts = evaluation_summary.facts(result)
    assert (facts["family"], facts["protocol"], facts["clips"]) == (
        "tiny",
        "leave_one_clip_out",
        CLIPS,
    )
    for name, own in facts["methods"].items():
        relative = [100 * error.relative.mean for error in result.errors[name]]
        assert own["relative_cm"] == pytest.approx(np.mean(relative), rel=1e-5)
        expected = np.std(relative, ddof=1) / np.sqrt(CLIPS)
        assert own["standard_error_cm"] == pytest.approx(expected, rel=1e-5)
    ours = [error.mean_squared_error for error in result.errors["posefield"]]
    assert facts["sigma_ratio"] == pytest.approx(np.mean(ours / result.sigma**2), rel=1e-5)
    assert facts["methods"]["mean"]["difference_cm"] == pytest.approx(
        facts["methods"]["mean"]["relative_cm"] - facts["methods"]["posefield"]["relative_cm"],
        abs=1e-4,
    )
    json.dumps(facts, allow_nan=False)


def test_sigma_of_each_joint_is_compared_with_that_joint(results):
    result = results[0][0]
    found = evaluation_summary.facts(result)["joint_sigma_ratio"]
    assert tuple(found) == result.joints
    joint = len(result.joints) - 1
    errors = [error.joints[joint] for error in result.errors["posefield"]]
    expected = np.mean(errors / result.joint_sigma[:, joint] ** 2)
    assert found[result.joints[joint]] == pytest.approx(expected, rel=1e-5)
    # Together they are what the answer as a whole is off by.
    squares = [np.mean(error.joints) for error in result.errors["posefield"]]
    assert squares == pytest.approx(
        [error.mean_squared_error for error in result.errors["posefield"]]
    )


def test_the_flag_is_held_to_its_promise_on_the_same_folds(results):
    result = results[0][0]
    found = evaluation_summary.facts(result)["support"]
    assert result.flags is not None and found["false_alarms"] == result.flags.alarms
    text = evaluation_summary.trust_text(result)
    assert len(text) == 2 and text[1].startswith("support: ")


def test_the_table_has_a_row_for_every_method(results):
    lines = evaluation_summary.table(results[0][0]).split("\n\n")[1].splitlines()
    assert len({len(line) for line in lines}) == 1
    rows = [line.split("|")[1].strip() for line in lines[2:]]
    assert rows == list(results[0][0].errors)


def test_the_page_is_the_same_twice_and_loads_nothing(results):
    html = evaluation_page.html("small motions", results[0])
    assert html == evaluation_page.html("small motions", results[0])
    text = html.decode()
    for name in methods.DEFINITIONS:
        assert name in text
    # Bars, clips, calibration, and a clip at its event.
    assert text.count("<img ") == text.count('src="data:') == 4 * len(results[0])
    assert "@import" not in text and text.count("http") == 0


def test_the_page_escapes_the_names_of_clips_and_the_description(results):
    markup = "<script>$x^2$"
    result = replace(results[0][0], clips=(markup,) * CLIPS, family=markup)
    text = evaluation_page.html(markup, [result]).decode()
    assert "<script>" not in text
    assert text.count("&lt;script&gt;$x^2$") >= 4
    # Negative control: other markup is that of the page.
    assert "<table>" in text


def test_the_page_has_the_learning_curve(results):
    near, far = np.array([[0.04, 0.02], [0.03, 0.01]]), np.array([[0.04, 0.03], [0.03, 0.02]])
    trials = {
        learning_curves.SUGGESTED: np.stack([near, near]),
        learning_curves.CHANCE: np.stack([far, far]),
    }
    curve = learning_curves.Learning((40, 92), trials)
    text = evaluation_page.html("small motions", results[0], curve).decode()
    assert text.count("<img ") == 4 * len(results[0]) + 1
    assert '<section id="learning">' in text


@pytest.fixture(scope="module")
def truth_result(small_recipe, examples):
    points = ground_truth.truth_points(6)
    return protocol.run_against_truth(small_recipe, examples[::2], points, JOBS, lambda a, b: None)


def test_truth_is_asked_where_bodies_can_be_and_is_reproducible():
    from posefield_train.sample import sample_controls

    points = ground_truth.truth_points(200)
    assert np.array_equal(points[:10], ground_truth.truth_points(10))
    for point in points:
        sample_controls.parse_controls(list(point))
    low, high = np.array([r[:2] for r in sample_controls.RANGES.values()]).T
    spread = (points - low) / (high - low)
    assert (spread.std(axis=0) > 0.2).all()


def test_the_truth_is_nearer_to_a_model_than_to_the_mean(truth_result):
    means = {one.name: one.mean.relative.mean for one in evaluation_summary.summarize(truth_result)}
    assert means["posefield"] < 0.5 * means["mean"]
    assert means["posefield"] < means["nearest"]


def run(monkeypatch, *words):
    """Exit code of the command line."""
    monkeypatch.setattr(sys, "argv", ["posefield", *map(str, words)])
    try:
        cli.main()
    except SystemExit as done:
        return done.code
    return 0


def test_the_command_writes_what_it_prints(tmp_path, folder, monkeypatch, capsys):
    path, found, page = (tmp_path / name for name in ("tiny.toml", "found.json", "found.html"))
    path.write_text(LABELLED)
    words = ("evaluate", path, "--data", folder, "--protocol", "performer")
    assert run(monkeypatch, *words, "--json", found, "--report", page) == 0
    facts = json.loads(found.read_text())
    assert facts["protocol"] == "leave_one_performer_out" and facts["others"] == []
    assert "| thin_plate_smoothed" in capsys.readouterr().out
    assert page.read_text().startswith("<!DOCTYPE html>")


def test_a_second_run_reads_finished_folds(tmp_path, folder, monkeypatch, capsys):
    path, kept = tmp_path / "tiny.toml", tmp_path / "folds"
    path.write_text(LABELLED)
    words = ("evaluate", path, "--data", folder, "--protocol", "performer", "--resume", kept)
    found = []
    for name in ("first.json", "second.json"):
        assert run(monkeypatch, *words, "--json-file", tmp_path / name) == 0
        files = sorted(kept.iterdir())
        found.append(((tmp_path / name).read_bytes(), [file.stat().st_mtime_ns for file in files]))
    # Times of solver steps are measured, and equal only where they are read.
    assert found[0] == found[1]
    assert len(found[0][1]) == 3
    assert capsys.readouterr().out.count("| posefield ") >= 2


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--protocol", "truth"), "tiny can only: clip, performer"),
        (("--report", "page.txt"), "expected a name that ends in .html"),
        (("--jobs", "0"), "jobs: 0, expected 1 or more"),
        (("--learning",), "tiny has no truth, expected the procedural family"),
        (("--joined", "none.toml"), "none.toml: cannot be read"),
        (("--joined", "tiny.toml"), "joined: both families overlap in speed"),
    ],
)
def test_what_cannot_be_asked_is_refused_first(tmp_path, folder, monkeypatch, capsys, words, said):
    path = tmp_path / "tiny.toml"
    path.write_text(LABELLED)
    monkeypatch.chdir(tmp_path)
    assert run(monkeypatch, "evaluate", path, "--data", folder, *words) in (2, 3)
    told = capsys.readouterr()
    assert said in told.err
    # No protocol has run: what one finds is told at once.
    assert told.out == ""


def test_a_missing_recipe_is_named(monkeypatch, capsys):
    assert run(monkeypatch, "evaluate") == 2
    assert "Missing argument 'RECIPE'" in capsys.readouterr().err
