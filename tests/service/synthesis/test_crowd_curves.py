"""Curves of crowds: those of each character alone, through levels, and of walking characters."""

from dataclasses import replace

import fixture_models
import numpy as np
import pytest

from posefield.inference import session
from posefield.locomotion import gait, locomotion_plan, walking_crowd
from posefield.motion.clip import Placement
from posefield.question.motion_question import PoseQuestion
from posefield.synthesis import crowd_synthesis, poses
from posefield.synthesis.synthesizer import Synthesizer
from posefield.validation.crowd_validation import Blending, CrowdQuestion

COUNT, SECONDS, RATE = 30, 3.0, 30.0
# The graph answers in float32, and sums a batch in another order than one row.
FLOAT32 = 1e-5
# Strides differ by walker in nothing but sway, so pressures are near the truth between examples.
NEAR = 0.02


@pytest.fixture(scope="module", params=["face", "curves"])
def face(models_trained, request):
    return opened(models_trained, request.param)


@pytest.fixture(scope="module")
def treading(models_trained):
    return opened(models_trained, "treading")


def opened(models_trained, name):
    content = models_trained.exported(name).content
    return Synthesizer(name, session.open_bytes(content, name))


def asked(model, **given):
    rng = np.random.default_rng(3)
    return CrowdQuestion(
        {control.name: rng.uniform(0.2, 0.8, COUNT) for control in model.session.card.controls},
        rng.uniform(0.1, 0.8, COUNT),
        Placement(rng.uniform(-9.0, 9.0, (COUNT, 3)), rng.uniform(-3.0, 3.0, COUNT)),
        (None,),
        np.zeros(COUNT, int),
        rng.integers(0, len(model.session.card.levels), COUNT),
        "travelling",
        "ok",
        **given,
    )


def alone(model, question, row, level):
    controls = {name: float(values[row]) for name, values in question.controls.items()}
    times = [float(question.times[row])]
    return poses.synthesize_poses(
        model, PoseQuestion(controls=controls, times=times, level=int(level))
    ).curves[0]


def test_each_character_has_the_curves_that_it_has_alone(face):
    question = asked(face)
    found = crowd_synthesis.synthesize_crowd(face, question)
    assert found.curve_names == tuple(curve.name for curve in face.session.card.curves)
    expected = np.stack([alone(face, question, row, question.detail[row]) for row in range(COUNT)])
    assert np.abs(found.curves - expected).max() < FLOAT32
    assert np.abs(found.curves[1:] - expected[:-1]).max() > 0.1


def test_curves_blend_between_levels_and_stay_within_their_limits(face):
    plain = asked(face, blending=None)
    shares = np.linspace(0.0, 1.0, COUNT)
    before = np.full(COUNT, len(face.session.card.levels) - 1)
    given = replace(plain, detail=np.zeros(COUNT, int), blending=Blending(before, shares))
    found = crowd_synthesis.synthesize_crowd(face, given).curves
    coarse, fine = (
        np.stack([alone(face, plain, row, level) for row in range(COUNT)])
        for level in (before[0], 0)
    )
    assert np.abs(found - (coarse + shares[:, None] * (fine - coarse))).max() < FLOAT32
    assert np.abs(found - fine).max() > 0.01
    assert found.min() >= 0.0 and found.max() <= 1.0


@pytest.fixture(scope="module")
def plan(treading):
    return walking_crowd.plan_random(gait.fit_gait(treading.session), 5, SECONDS, RATE, seed=2)


def test_soles_press_at_the_phases_of_the_plan(treading, plan):
    shown = locomotion_plan.constant_schedule(0, plan.phases.shape)
    made = walking_crowd.crowd_of_plan(treading.session, plan, shown)
    assert made.curves == tuple(fixture_models.SOLES)
    found = np.concatenate([motions.curves for motions in made.batches])
    speeds = plan.controls[:, :, 0] / 3.6
    pairs = zip(plan.phases.ravel(), speeds.ravel(), strict=True)
    expected = np.stack([fixture_models.sole_pressure(np.array([u]), v)[0] for u, v in pairs])
    expected = expected.reshape(found.shape)
    assert np.sqrt(np.mean(np.square(found - expected))) < NEAR
    # Half a stride later the other sole presses.
    assert np.sqrt(np.mean(np.square(found[..., ::-1] - expected))) > 5 * NEAR
