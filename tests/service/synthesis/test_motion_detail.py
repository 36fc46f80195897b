"""Tests of the detail of cycles: its statistics, and its effect on answers."""

from dataclasses import replace

import numpy as np
import pytest

from posefield.inference import reduced_motion, session
from posefield.question.motion_question import ClipQuestion
from posefield.synthesis import clips
from posefield.synthesis.synthesizer import NO_DETAIL, Synthesizer

SEED = 7
DEVIATIONS = np.outer([0.0, 0.02, 0.0, 0.01], np.linspace(1.0, 0.5, 12))


@pytest.fixture(scope="module")
def plain(walk_path) -> Synthesizer:
    """A model of a walk whose file has no detail."""
    return Synthesizer("walk", session.load(walk_path))


@pytest.fixture(scope="module")
def walk(plain) -> Synthesizer:
    """The same with detail."""
    opened = plain.session
    making = replace(opened.card.making, detail=reduced_motion.to_bytes(DEVIATIONS))
    return Synthesizer("walk", replace(opened, card=replace(opened.card, making=making)))


def asked(model, **more):
    controls = {c.name: c.default for c in model.session.card.controls}
    own = {"exact": "none", "feet": "as_predicted"}
    return ClipQuestion(controls=controls, fps=50.0, **own | more)


def clip(model, **more):
    """Joint positions (F, J, 3) of a clip, and its trust."""
    answer = clips.synthesize_clip(model, asked(model, **more))
    return answer.clip.positions(), answer.trust


def test_samples_have_the_deviations_and_close(rng):
    frames, seeds = 41, 400
    drawn = np.array([reduced_motion.sample(DEVIATIONS, frames, seed) for seed in range(seeds)])
    assert np.abs(drawn[:, 0] - drawn[:, -1]).max() < 1e-12
    variances = np.sum(np.square(DEVIATIONS), axis=0)
    ratios = np.mean(np.square(drawn), axis=(0, 1)) / variances
    assert np.allclose(ratios, 1.0, atol=0.2) and ratios.mean() == pytest.approx(1.0, abs=0.05)
    doubled = reduced_motion.sample(2.0 * DEVIATIONS, frames, SEED)
    assert np.allclose(doubled, 2.0 * drawn[SEED])


def test_detail_is_sampled_by_the_seed_of_the_take(walk):
    mean, trust = clip(walk)
    one, own = clip(walk, detail=True)
    assert np.abs(one - mean).max() > 0.005 and own.sigma == trust.sigma
    assert np.array_equal(clip(walk, detail=True)[0], one)
    taken, _ = clip(walk, take=SEED)
    both, _ = clip(walk, take=SEED, detail=True)
    assert np.abs(both - taken).max() > 0.005 and np.abs((both - taken) - (one - mean)).max() > 1e-3
    assert own.warnings == ()


def test_a_loop_with_detail_closes(walk):
    found, _ = clip(walk, detail=True, loop=True, root="in_place")
    assert np.abs(found[-1] - found[0]).max() < 1e-9
    assert np.abs(found - clip(walk, loop=True, root="in_place")[0]).max() > 0.005


def test_a_file_without_detail_answers_with_a_warning(plain):
    found, trust = clip(plain, detail=True)
    assert trust.warnings == (NO_DETAIL,)
    assert np.array_equal(found, clip(plain)[0])
