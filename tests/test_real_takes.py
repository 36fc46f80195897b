"""Tests of takes and detail of the models of real motion capture."""

import numpy as np
import pytest

from posefield.inference import session
from posefield.kriging import kriging_model, random_field
from posefield.motion import contact_detection, skeleton
from posefield.question.motion_question import ClipQuestion
from posefield.synthesis import clips
from posefield.synthesis.synthesizer import Synthesizer
from posefield_train.align import time_alignment

pytestmark = pytest.mark.system

RATE = 30.0
"""Frames a second of the clips, as by default. Faster ones show the noise of the capture."""
SEEDS, FIELDS, POINTS = 200, 8, 30
# Acceleration of takes over that of captured clips.
ACCELERATED = {"cmu_walk": (0.8, 1.2), "hdm05_grab_high": (0.7, 1.3)}


@pytest.fixture(scope="module", params=ACCELERATED)
def made(request, real_data, models_trained):
    """A recipe's examples and the model that training makes of them."""
    own, trained, exported = models_trained.captured(request.param, real_data)
    opened = session.open_bytes(exported.content, own.name)
    return trained.examples, Synthesizer(own.name, opened)


def captured(example):
    """Joint positions (F, J, 3) of a captured clip at RATE."""
    clip = example.clip
    frames = round(clip.duration * RATE) + 1
    rotations, path = time_alignment.resample(clip, np.linspace(0.0, 1.0, frames))
    translations = skeleton.translations(clip.translations.mean(axis=0), path)
    return skeleton.positions(clip.skeleton.parents, rotations, translations)


def answered(model, index, **asked):
    """Joint positions (F, J, 3) of the answer at a captured clip's controls and labels."""
    card = model.session.card
    names = dict(card.clip_names(index))
    who = names.pop("performer", None)
    controls = {c.name: v for c, v in zip(card.controls, card.examples[index], strict=True)}
    own = {"exact": "none", "feet": "as_predicted"} | asked
    question = ClipQuestion(controls=controls, performer=who, labels=names, fps=RATE, **own)
    return clips.synthesize_clip(model, question).clip.positions()


def acceleration(motions):
    """Mean acceleration, m/s2, of the joints relative to the root."""
    found = [np.diff(motion - motion[:, :1], 2, axis=0) for motion in motions]
    return np.mean([np.linalg.norm(one, axis=-1).mean() for one in found]) * RATE**2


def skate(model, motions):
    feet = list(model.session.card.feet)
    return np.mean(
        [contact_detection.mean_skate_speed(motion[:, feet], RATE) for motion in motions]
    )


def test_fields_have_variogram_and_variances_of_the_kriging(made):
    weights = made[1].session.kriging_weights
    hyper, samples = weights.hyper, weights.samples
    rng = np.random.Generator(np.random.PCG64(0))
    places = samples[rng.integers(len(samples), size=POINTS)]
    d = len(hyper.scales)
    places[:, :d] = rng.uniform(-1.0, 1.0, (POINTS, d))
    drawn = [random_field.draw_field(hyper, 1 + seed, FIELDS) for seed in range(SEEDS)]
    values = np.concatenate([field.evaluate(places).T for field in drawn])
    rows, columns = np.triu_indices(POINTS, 1)
    prior = kriging_model.prior_variances(hyper, places)
    covariances = kriging_model.covariances(hyper, places, places)[rows, columns]
    model = 0.5 * (prior[rows] + prior[columns]) - covariances
    simulated = 0.5 * np.mean(np.square(values[:, rows] - values[:, columns]), axis=0)
    bins = np.array_split(np.argsort(model), 6)
    ratios = np.array([simulated[own].sum() / model[own].sum() for own in bins])
    assert np.allclose(ratios, 1.0, atol=0.1)
    given = [random_field.simulate(weights, 1 + seed, FIELDS) for seed in range(SEEDS)]
    deviations = np.concatenate([field.evaluate(places).T for field in given])
    own, across = weights.weights(places), kriging_model.covariances(hyper, places, samples)
    error = np.einsum("bn,nm,bm->b", own, kriging_model.noisy(hyper, samples), own)
    variances = prior + hyper.nugget + error - 2.0 * np.sum(own * across, axis=1)
    assert np.mean(deviations.var(axis=0) / variances) == pytest.approx(1.0, abs=0.1)
    errors = deviations.mean(axis=0) / np.sqrt(deviations.var(axis=0) / len(deviations))
    assert np.sqrt(np.mean(np.square(errors))) < 1.3


def test_takes_accelerate_as_captured_clips_do(made):
    examples, model = made
    some = range(0, len(examples), 1 + model.session.card.cyclic)
    low, high = ACCELERATED[model.name]
    real = acceleration([captured(examples[i]) for i in some])
    cyclic = model.session.card.cyclic
    taken = [answered(model, i, take=1 + i, detail=cyclic) for i in some]
    assert low < acceleration(taken) / real < high
    plain = [answered(model, i) for i in some]
    if not cyclic:
        # Of takes with durations of their own the short ones accelerate the most.
        assert acceleration(taken) < 1.3 * acceleration(plain)
        return
    assert acceleration(plain) / real < 0.85
    detailed = [answered(model, i, detail=True) for i in some]
    assert 0.85 < acceleration(detailed) / real < 1.15
    assert skate(model, taken) < 1.2 * skate(model, [captured(examples[i]) for i in some])


def test_the_card_says_what_detail_does(made):
    _, model = made
    facts = model.session.card.diagnostics.get("detail")
    assert (facts is not None) == model.session.card.cyclic
    if facts:
        assert facts["acceleration"] < 0.7 and 0.95 < facts["sampled"] < 1.05
