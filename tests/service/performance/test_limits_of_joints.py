"""Performances keep the limits of knees and elbows that their models have."""

import json
from dataclasses import replace

import numpy as np
import pytest
from limited_models import excess, known_limits

from posefield.motion import hinges
from posefield.motion.hinges import MOST
from posefield.performance import composition
from posefield.performance.script import resolve_script, shared_hinges
from posefield.question.json_decoding import decode_question
from posefield.question.performance_question import PerformanceQuestion
from posefield.synthesis.synthesizer import Synthesizer

SCRIPT = {
    "segments": [
        {"kind": "walk", "model": "walk", "seconds": 2.0, "speed": 1.2},
        {"kind": "hold", "seconds": 1.0},
        {"kind": "walk", "model": "walk", "seconds": 2.0, "turn": 0.4},
    ],
    "take": 8,
    "fps": 60,
}


@pytest.fixture(scope="module")
def limited(shipped_walk):
    return known_limits(shipped_walk)


def performed(model):
    question = decode_question(PerformanceQuestion, json.dumps(SCRIPT).encode())
    return composition.perform(resolve_script(question, {"walk": model}.__getitem__), 10_000)


def test_joins_holds_and_steps_keep_the_limits(limited, shipped_walk):
    card = limited.session.card
    limits = hinges.from_card(card.hinges)
    assert (excess(limits, [performed(limited)]) < MOST + 1e-3).all()
    # Negative control: a model without limits.
    without = replace(shipped_walk.session, card=replace(card, hinges=()))
    assert excess(limits, [performed(Synthesizer("walk", without))]).max() > 2.0 * MOST


def test_a_character_has_the_ranges_of_all_its_models(limited):
    card = limited.session.card
    (wide, *others) = card.hinges
    deep = replace(wide, high=(2.5, 0.0, 0.0))
    more = replace(card, name="squat", hinges=(deep, *others))
    assert shared_hinges(card, [card, more])[0].high[0] == pytest.approx(2.5)
    assert shared_hinges(card, [card])[1:] == card.hinges[1:]
    # Poses of a model without limits are not forced into those of another one.
    assert shared_hinges(card, [card, replace(card, name="old", hinges=())]) == ()
    assert np.degrees(MOST) == pytest.approx(3.0)
