"""Tests of the predicted sizes of files: upper bounds per joint and frame."""

import numpy as np
import pytest

from posefield.encode.formats import CLIP_ENCODERS, CROWD_ENCODERS
from posefield.inference import session
from posefield.motion.clip import Placement
from posefield.question.motion_question import ClipQuestion
from posefield.synthesis import clips, crowd_synthesis
from posefield.synthesis.synthesizer import Synthesizer
from posefield.validation.crowd_validation import CrowdQuestion

SHARES = np.linspace(0.03, 0.97, 7)


@pytest.fixture(scope="module")
def model(walk_path):
    """One of few joints, whose root weighs most."""
    return Synthesizer("walk", session.load(walk_path))


def controls(model, share):
    return {
        c.name: c.minimum + share * (c.maximum - c.minimum) for c in model.session.card.controls
    }


@pytest.mark.parametrize("name", CLIP_ENCODERS)
def test_no_clip_takes_more_than_was_reckoned(name, model, shipped_walk):
    # Avatars need a whole body.
    model = shipped_walk if name == "vrma" else model
    joints, encoder = len(model.session.card.skeleton) + 1, CLIP_ENCODERS[name]
    for share in SHARES:
        question = controls(model, share)
        long, short = (
            clips.synthesize_clip(model, ClipQuestion(controls=question, fps=f))
            for f in (400.0, 200.0)
        )
        more = len(encoder.encode(long)) - len(encoder.encode(short))
        per_joint = more / (len(long.clip) - len(short.clip)) / joints
        assert encoder.bytes_per_joint / 3 < per_joint < encoder.bytes_per_joint


@pytest.mark.parametrize("name", CROWD_ENCODERS)
def test_no_crowd_takes_more_than_was_reckoned(name, model):
    joints, encoder = len(model.session.card.skeleton) + 1, CROWD_ENCODERS[name]
    sizes = [
        len(encoder.encode(crowd_synthesis.synthesize_crowd(model, company(model, n))))
        for n in (100, 400)
    ]
    per_joint = (sizes[1] - sizes[0]) / 300 / joints
    assert encoder.bytes_per_joint / 3 < per_joint < encoder.bytes_per_joint


def company(model, count):
    columns = {name: np.full(count, value) for name, value in controls(model, 0.37).items()}
    place = Placement(np.full((count, 3), 0.123456), np.full(count, 0.7))
    level = np.zeros(count, dtype=np.int64)
    return CrowdQuestion(
        columns,
        np.full(count, 0.1),
        place,
        (None,),
        np.zeros(count, dtype=np.int64),
        level,
        "travelling",
        "warn",
        None,
    )
