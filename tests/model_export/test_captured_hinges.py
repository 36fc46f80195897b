"""Tests of the hinges of knees and elbows on the model card, on the shipped family of walks."""

from dataclasses import replace

import numpy as np
import pytest

from posefield.model_file import card_check, checked_file, model_card
from posefield.motion import hinges, quat
from posefield.motion.clip import Clip
from posefield_train.graph import captured_hinges
from posefield_train.source.ingest import Example

KNEE_AXIS = (np.cos(np.radians(20.0)), np.sin(np.radians(20.0)), 0.0)
"""Axis of the left knee in files of CMU, which are made from joints of one angle."""


@pytest.fixture(scope="module")
def walks(shipped_walk):
    """Return two examples whose left knee bends by 5 to 70 and by 5 to 100 degrees."""
    card, found = shipped_walk.session.card, []
    for most in (70.0, 100.0):
        rotations = np.tile(quat.IDENTITY, (50, len(card.skeleton), 1))
        knee = card.skeleton.names.index(card.roles["leftLowerLeg"])
        flexion = np.radians(np.linspace(5.0, most, 50))
        rotations[:, knee] = quat.from_axis_angle(np.array(KNEE_AXIS), flexion)
        roots = np.tile(card.skeleton.offsets, (50, 1, 1))
        clip = Clip(card.skeleton, rotations, roots, 60.0)
        found.append(Example(None, clip, np.zeros(1), (), ()))
    return found


def test_the_axis_and_the_range_of_a_knee_are_measured(walks, shipped_walk):
    (knee,) = captured_hinges.measure_hinges(walks[:1], shipped_walk.session.card.roles)
    assert knee.axis == pytest.approx(KNEE_AXIS, abs=2e-3)
    assert np.degrees([knee.low[0], knee.high[0]]) == pytest.approx([5.0, 70.0], abs=0.1)
    # Arms do not bend in these clips, and limbs without roles have no hinges.
    assert captured_hinges.measure_hinges(walks, {}) == ()
    (wide,) = captured_hinges.widened([knee], walks[1:])
    assert np.degrees([wide.low[0], wide.high[0]]) == pytest.approx([5.0, 100.0], abs=0.1)


def test_cards_with_hinges_are_read_again(walks, shipped_walk):
    card = shipped_walk.session.card
    found = captured_hinges.measure_hinges(walks, card.roles)
    text = {
        key: value.encode() for key, value in model_card.dump(replace(card, hinges=found)).items()
    }
    assert checked_file.decode_card(text).hinges == found
    assert "hinges" not in model_card.plain_values(replace(card, hinges=found))
    del text["posefield.hinges"]
    assert len(hinges.from_card(checked_file.decode_card(text).hinges)) == 0


@pytest.mark.parametrize(
    "wrong",
    [{"joint": 999}, {"axis": (0.0, 0.0, 0.0)}, {"bone": KNEE_AXIS}, {"low": (2.0, 0.0, 0.0)}],
    ids=lambda wrong: next(iter(wrong)),
)
def test_hinges_that_no_joint_can_have_are_refused(walks, shipped_walk, wrong):
    card = shipped_walk.session.card
    (knee,) = captured_hinges.measure_hinges(walks[:1], card.roles)
    card_check.check(replace(card, hinges=(knee,)))
    with pytest.raises(ValueError, match="hinges"):
        card_check.check(replace(card, hinges=(replace(knee, **wrong),)))
