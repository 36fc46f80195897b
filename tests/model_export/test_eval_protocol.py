"""Tests of the evaluation protocol: held-out clips do not influence their predictions."""

import json
from dataclasses import replace

import numpy as np
import pytest
from joblib import parallel_config
from minimal import TOML, plain_recipe, small_clip, write_clips

from posefield.common.errors import TrainingError
from posefield.kriging import support
from posefield_train.evaluate import motion_errors, predictions, protocol, summary
from posefield_train.evaluate.predictions import DEFINITIONS, OURS, Queries
from posefield_train.evaluate.protocol import Fold
from posefield_train.jobs import ProcessJobs
from posefield_train.kriging import gaussian_process
from posefield_train.source import ingest
from posefield_train.source.recipe import Recipe
from posefield_train.training import train_examples

CLIPS = 12
# In this process: starting others takes longer, and test_eval_cluster does.
JOBS = ProcessJobs(1)
LABELLED = TOML.replace('file = "file"\n', 'file = "file"\nperformer = "who"\n').replace(
    "[size]", '[kriging]\nlabel = "performer"\ncovariance = "matern52"\ndrift = 1\n[size]'
)


@pytest.fixture(scope="module", autouse=True)
def _sequential():
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
    (path / "recipe.toml").write_text(LABELLED)
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
    reported = []
    both = [
        protocol.run_protocol(recipe, family, name, JOBS, lambda *parts: reported.append(parts))
        for name in ("clip", "performer")
    ]
    return both, reported


def test_every_clip_is_held_out_once_with_all_of_its_take(family):
    files = [replace(e, recording="") for e in family]
    same = [
        replace(e, row=replace(e.row, file=family[i // 3].row.file)) for i, e in enumerate(files)
    ]
    stated = [replace(e, recording=f"recording {i // 3}") for i, e in enumerate(family)]
    for examples, parts in ((family, CLIPS), (files, CLIPS), (same, CLIPS // 3)):
        listed = protocol.clip_folds(examples)
        assert sorted(i for fold in listed for i in fold.held_out) == list(range(CLIPS))
        assert len(listed) == parts
        for fold in listed:
            rest, held = fold.split(examples)
            assert not {e.row.file for e in rest} & {e.row.file for e in held}
    assert [fold.held_out for fold in protocol.clip_folds(stated)] == [
        fold.held_out for fold in protocol.clip_folds(same)
    ]
    with pytest.raises(
        TrainingError, match=r"all \d+ clips are of one recording, expected two or more"
    ):
        protocol.clip_folds([replace(e, recording="one") for e in family])


def test_performers_are_held_out_whole(family):
    assert [set(fold.held_out) for fold in protocol.performer_folds(family)] == [
        set(range(first, CLIPS, 3)) for first in range(3)
    ]
    assert protocol.protocols(family) == ["clip", "performer"]
    alone = [replace(e, row=replace(e.row, performer="a")) for e in family]
    assert protocol.protocols(alone) == ["clip"]


def test_a_clip_held_out_has_no_say_in_what_is_predicted_for_it(recipe, family, results):
    """The protocol's errors are those of a model that never saw the clip."""
    held, joint = 4, family[0].clip.skeleton.names.index("LeftHand")
    queries = Queries(family[held].controls[None], [family[held].row.labels])
    captured = motion_errors.motion_of_clip(
        family[held].clip, motion_errors.MotionEvent(joint, 1.0)
    )

    def errors(examples):
        trained = train_examples(recipe, examples)
        motions = predictions.predict(trained, queries).motions
        return {
            name: motion_errors.compare_motions(made, captured, (joint,)).relative.mean
            for name, (made,) in motions.items()
        }

    by_hand = errors([example for i, example in enumerate(family) if i != held])
    measured = {name: results[0][0].errors[name][held].relative.mean for name in by_hand}
    assert measured == pytest.approx(by_hand, abs=1e-9)
    # Negative control: methods that saw it come nearer.
    seen = errors(family)
    assert all(seen[name] < 0.95 * measured[name] for name in DEFINITIONS)


class Backwards:
    """Jobs whose results come as they finished, and when run again, in the reverse order."""

    results = None

    def run(self, function, arguments, shared=()):
        if self.results:
            return reversed(self.results)
        self.results = list(JOBS.run(function, arguments, shared))
        return iter(self.results)


def test_the_order_in_which_jobs_finish_changes_nothing(recipe, family):
    plain = recipe.model_copy(update={"event": None})
    jobs = Backwards()
    first, backwards = (
        protocol.run_protocol(plain, family[:5], "clip", jobs, lambda *_: None) for _ in range(2)
    )
    # Text, as a NaN is not equal to itself; the order of the methods counts too.
    assert str(summary.facts(first)) == str(summary.facts(backwards))
    assert np.array_equal(first.joint_sigma, backwards.joint_sigma)
    assert summary.facts(first)["methods"][OURS]["effector_cm"] is None, "without an event"


def test_training_errors_name_the_clips_that_are_held_out(recipe, family):
    with pytest.raises(TrainingError, match=r"held out: 2 samples, expected at least 3"):
        protocol.run_protocol(recipe, family[:4], "performer", JOBS, lambda *_: None)


def test_facts_are_the_measured_errors(results):
    result = results[0][0]
    facts = summary.facts(result)
    assert (facts["family"], facts["protocol"], facts["clips"]) == (
        "tiny",
        "leave_one_clip_out",
        CLIPS,
    )
    for name, figures in facts["methods"].items():
        relative = [100 * error.relative.mean for error in result.errors[name]]
        assert figures["relative_cm"] == pytest.approx(np.mean(relative), rel=1e-5)
        expected = np.std(relative, ddof=1) / np.sqrt(CLIPS)
        assert figures["standard_error_cm"] == pytest.approx(expected, rel=1e-5)
        assert figures["definition"] == DEFINITIONS[name]
    ours = [error.mean_squared_error for error in result.errors[OURS]]
    assert facts["sigma_ratio"] == pytest.approx(np.mean(ours / result.sigma**2), rel=1e-5)
    methods = facts["methods"]
    assert methods["mean"]["difference_cm"] == pytest.approx(
        methods["mean"]["relative_cm"] - methods[OURS]["relative_cm"], abs=1e-4
    )
    assert facts["support"]["false_alarms"] == result.flags.alarms
    assert summary.trust_text(result)[1].startswith("support: ")
    json.dumps(facts, allow_nan=False)


def test_clips_that_agree_within_takes_count_as_one(rng):
    recordings, values = np.repeat(np.arange(6), 5), rng.standard_normal(6)
    error = summary.clustered_standard_error(values[recordings], recordings)
    assert error == pytest.approx(values.std(ddof=1) / np.sqrt(6))
    # Negative control: over clips the same differences look more certain than they are.
    assert error > 2 * summary.clustered_standard_error(values[recordings], np.arange(30))
    assert summary.clustered_standard_error(values, np.zeros(6, dtype=int)) == 0.0


def test_the_likelihood_is_scikit_learns(rng):
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

    points, values = rng.uniform(-1.0, 1.0, (24, 3)), rng.standard_normal((24, 2))
    kernel = ConstantKernel(1.0) * RBF(np.ones(3)) + WhiteKernel(0.1)
    theta = kernel.theta + 0.3 * rng.standard_normal(5)
    model = GaussianProcessRegressor(kernel, optimizer=None).fit(points, values)
    expected, slope = model.log_marginal_likelihood(theta, eval_gradient=True)
    likelihood = gaussian_process.MarginalLikelihood(np.square(points[:, None] - points), values)
    negative, negative_slope = likelihood.negative(theta)
    assert negative == pytest.approx(-expected, rel=1e-10)
    assert negative_slope == pytest.approx(-slope, rel=1e-8)
    # Negative control: elsewhere it is another number.
    assert likelihood.negative(theta + 0.1)[0] != pytest.approx(-expected, rel=1e-4)


def test_a_second_run_reads_finished_folds_and_prints_its_results(tmp_path, folder, posefield):
    kept = tmp_path / "folds"
    words = ("evaluate", folder / "recipe.toml", "--protocol", "performer", "--resume", kept)
    runs = []
    for name in ("first.json", "second.json"):
        code, out, err = posefield(*words, "--json", tmp_path / name)
        assert code == 0, err
        assert "| gp " in out and "  mean: the mean motion" in out
        files = sorted(kept.iterdir())
        runs.append(((tmp_path / name).read_bytes(), [file.stat().st_mtime_ns for file in files]))
    assert runs[0] == runs[1]
    assert len(runs[0][1]) == 3
    facts = json.loads(runs[0][0])
    assert facts["protocol"] == "leave_one_performer_out" and facts["others"] == []


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--protocol", "performer"), "tiny can only: clip"),
        (("--jobs", "0"), "jobs: 0, expected 1 or more"),
    ],
)
def test_what_cannot_be_evaluated_is_refused_first(tmp_path, folder, posefield, words, message):
    path = tmp_path / "tiny.toml"
    path.write_text(TOML)
    code, out, err = posefield("evaluate", path, "--data", folder, *words)
    assert code in (2, 3) and message in err
    # No protocol has run: its result would be printed at once.
    assert out == ""


def test_clips_beyond_all_others_are_flagged_and_those_captured_evenly_seldom(rng):
    controls, names = rng.random((60, 2)) * [1.0, 3.0], ("left", "up")
    parts = [Fold((i, i + 1)) for i in range(0, 60, 2)]
    flags = protocol.measure_flags(controls, names, parts)
    assert flags.alarms < 0.15 and flags.beyond == {"left": 1.0, "up": 1.0}
    # A fold does not know what it holds out: its two clips far beyond all others are flagged.
    alone = np.vstack([controls, [[5.0, 1.0]], [[5.0, 1.1]]])
    assert protocol.measure_flags(alone, names, [*parts, Fold((60, 61))]).alarms >= 2 / 62
    assert (support.fit_support(alone).beyond(alone[60:]) == 0.0).all()
