"""Tests of adaptation to a new performer: accuracy, and unchanged known performers."""

from dataclasses import replace

import newcomers
import numpy as np
import pytest
from families import sample_walk

import posefield_train
from posefield.common.errors import TrainingError
from posefield.motion import quat
from posefield_train import training
from posefield_train.adapt import adaptation, canonical_clips
from posefield_train.evaluate import motion_errors, predictions
from posefield_train.evaluate.predictions import Queries
from posefield_train.kriging import universal_kriging
from posefield_train.source import canonical, ingest
from posefield_train.tensor import hosvd

SHOWN, ASKED = (2.0, 7.0, 12.0), (4.0, 9.5)


@pytest.fixture(scope="module")
def recipe():
    return newcomers.recipe()


@pytest.fixture(scope="module")
def trained(recipe, tmp_path_factory):
    folder = newcomers.write(tmp_path_factory.mktemp("family") / "small")
    return posefield_train.train(recipe, folder)


@pytest.fixture(scope="module")
def known(recipe, trained):
    return canonical_clips.adaptable(trained)


def examples(trained, who, controls):
    """Examples of a performer at values of the control."""
    row = trained.examples[0].row
    return [
        ingest.Example(
            replace(row, file=row.file.with_name(f"{who}{value:g}.bvh"), performer=who),
            canonical.canonicalize(newcomers.clip(who, value), False, False)[0],
            np.array([value]),
            (),
            (),
        )
        for value in controls
    ]


@pytest.fixture(scope="module")
def adapted(trained, known):
    return adaptation.adapt(known, examples(trained, "cy", SHOWN), "cy")


def misses(recipe, trained, model, name, whose="cy"):
    """Mean distance of a model's answers from a performer's own clips that it was not shown, m."""
    asked = examples(trained, whose, ASKED)
    said = Queries(np.stack([e.controls for e in asked]), [{"performer": name}] * len(asked))
    made = predictions.predict_posefield(replace(trained, model=model), said)
    pairs = zip(made, asked, strict=True)
    return np.mean(
        [
            motion_errors.compare_motions(
                own, motion_errors.motion_of_clip(e.clip, None), ()
            ).plain_relative.mean
            for own, e in pairs
        ]
    )


def test_a_newcomer_is_met_by_name_and_nobody_else_is(recipe, trained, known, adapted):
    unknown = misses(recipe, trained, trained.model, "")
    own = misses(recipe, trained, adapted.model, "cy")
    assert own < 0.35 * unknown
    # Negative controls: another name, and another's clips under the newcomer's name.
    assert misses(recipe, trained, adapted.model, "a") > 2.0 * own
    others = adaptation.adapt(known, examples(trained, "b", SHOWN), "cy")
    assert misses(recipe, trained, others.model, "cy") > 2.0 * own


def test_those_who_were_known_are_met_as_before(recipe, trained, known, adapted):
    """Measured 6.6 mm from their own clips before and 6.7 mm after."""
    before, after = (
        np.mean([misses(recipe, trained, model, who, who) for who in ("a", "b", "d")])
        for model in (trained.model, adapted.model)
    )
    assert after < 0.008 and after < 1.2 * before
    assert misses(recipe, trained, adapted.model, "a", "b") > 0.02
    old, new = trained.model, adapted.model
    assert new.bank.labels["performer"] == ("a", "b", "cy", "d")
    assert old.bank.labels["performer"] == ("a", "b", "d")
    controls, times = trained.samples.half_ranges * 7.0 + 7.0, np.full((newcomers.CLIPS, 1), 0.5)
    whose = [old.bank.labels["performer"][i] for i in trained.samples.label_indices[0]]

    def joints(model, names):
        order = [model.bank.labels["performer"].index(name) for name in names]
        labels = np.eye(model.bank.label_count)[order]
        return model.evaluate(controls, times, labels).positions(known.skeleton.parents)

    gaps = np.linalg.norm(joints(new, whose) - joints(old, whose), axis=-1).mean()
    # Negative control: asked for by the places of their labels, which have moved.
    wrong = ["cy" if name == "d" else name for name in whose]
    assert gaps < 0.008 < np.linalg.norm(joints(new, wrong) - joints(old, whose), axis=-1).mean()


def test_no_sign_hangs_on_the_machine(known, adapted, monkeypatch):
    def extended():
        numbers = adapted.new_clips.numbers
        parents, weights = known.skeleton.parents, known.joint_weights
        return adaptation.extend(known.model, parents, weights, numbers, known.truncation).tensor

    own, eigh, qr = extended(), np.linalg.eigh, np.linalg.qr

    def turned_qr(columns):
        q, r = qr(columns)
        signs = np.where(np.arange(q.shape[1]) % 2, 1.0, -1.0)
        return q * signs, signs[:, None] * r

    # A machine whose LAPACK chooses other signs.
    monkeypatch.setattr(np.linalg, "qr", turned_qr)
    monkeypatch.setattr(np.linalg, "eigh", lambda rows: (eigh(rows)[0], -eigh(rows)[1]))
    assert np.allclose(extended().values, own.values, rtol=0, atol=1e-9)
    # Negative control: as they come, the vectors of such a machine differ, and not when turned.
    gram = adapted.new_clips.numbers[0] @ adapted.new_clips.numbers[0].T
    here, there = eigh(gram)[1], np.linalg.eigh(gram)[1]
    assert np.abs(here - there).max() > 1e-3
    assert np.array_equal(hosvd.fix_signs(here), hosvd.fix_signs(there))


def test_a_range_that_grows_moves_no_field(trained, known):
    """The same distances in a longer unit: the old samples alone give the very same field."""
    bank = known.model.bank
    far = examples(trained, "cy", (30.0,))
    laid = adaptation.extend_samples(bank, known.groups, far, "cy")
    assert (laid.low, laid.high) == (0.0, 30.0) and laid.growth == pytest.approx(30 / 14)
    n, values = len(bank.pose.samples), bank.pose.values
    rng = np.random.Generator(np.random.PCG64(1))
    controls = rng.uniform(-5.0, 20.0, (50, 1))
    nobody = np.zeros((50, bank.label_count))
    before = bank.pose.predict(bank.points(controls, nobody))

    def after(hyper):
        solved = universal_kriging.solve(hyper, laid.samples.points[:n], values)
        grown = replace(bank, low=laid.low, high=laid.high)
        return solved.predict(grown.points(controls, np.zeros((50, 4))))

    hyper = laid.hyper(bank.pose.hyper)
    assert np.abs(after(hyper) - before).max() < 1e-9
    # Negative control: scales that stayed as they were.
    assert np.abs(after(bank.pose.hyper) - before).max() > 1e-3


def test_a_clip_of_another_action_is_refused_with_the_numbers(trained, known):
    good = examples(trained, "cy", SHOWN)
    canonical_clips.refuse_outliers(known, canonical_clips.to_canonical(known, good))
    rotations = good[1].clip.rotations.copy()
    rotations[:, 1] = quat.from_axis_angle(np.array([1.0, 0.0, 0.0]), np.array(2.0))
    strange = [good[0], replace(good[1], clip=replace(good[1].clip, rotations=rotations))]
    with pytest.raises(TrainingError, match=r"cy7\.bvh: lies \d+\.\d cm .* times the .* at most 2"):
        canonical_clips.refuse_outliers(known, canonical_clips.to_canonical(known, strange))


@pytest.fixture(scope="module")
def walkers(strides):
    """A walk of two walkers who are told apart, and strides that a third shows."""
    plain = sample_walk.recipe()
    told = plain.kriging.model_copy(update={"label": ["performer"]})
    recipe = plain.model_copy(update={"kriging": told})
    named = [
        replace(e, row=replace(e.row, performer="ab"[i % 2])) for i, e in enumerate(strides[3:])
    ]
    trained = training.train_examples(recipe, named)
    return recipe, trained, strides[:3]


def test_a_newcomers_cycle_closes_and_gets_as_far_as_it_did(walkers):
    _, trained, shown = walkers
    model = adaptation.adapt(canonical_clips.adaptable(trained), shown, "new").model
    who = np.eye(3)[[model.bank.labels["performer"].index("new")]]
    for example in shown:
        seconds = model.evaluate(example.controls[None], np.zeros((1, 1)), who).duration[0]
        assert seconds == pytest.approx(example.clip.duration, rel=0.05)
        found = model.evaluate(example.controls[None], np.array([[0.0, seconds]]), who)
        way = example.clip.root_path[-1] - example.clip.root_path[0]
        gone = found.root_position[0, 1] - found.root_position[0, 0]
        assert np.linalg.norm(gone - way) < 0.05 < np.linalg.norm(way)
        # All but where the root is and heads: the last pose is the first.
        ends = found.rotations[0, :, 1:]
        assert np.abs(ends[0] - ends[1]).max() < 1e-9
        middle = model.evaluate(example.controls[None], np.array([[seconds / 2]]), who)
        assert np.abs(middle.rotations[0, 0, 1:] - ends[0]).max() > 0.1
