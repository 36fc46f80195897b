"""Tests of walking crowds whose feet stand."""

import numpy as np
import pytest
from changed_cards import with_card

from posefield.common.errors import InvalidField
from posefield.inference import session
from posefield.locomotion import gait, walking_crowd
from posefield.motion import skeleton
from posefield.question.walk_question import WalkQuestion
from posefield.synthesis import walking_feet
from posefield.synthesis.synthesizer import Synthesizer

RATE = 30.0
PARTS = ("rotations", "root_position", "bone_offsets", "levels")


@pytest.fixture(scope="module")
def model(walk_path):
    return Synthesizer("stroll", session.load(walk_path))


@pytest.fixture(scope="module")
def own(model):
    return gait.fit_gait(model.session)


def built(model, own, **asked):
    """A crowd, its facts, and its motions in one."""
    order = WalkQuestion(**{"count": 12, "seconds": 6.0, **asked})
    made = walking_feet.build_crowd(model, own, order)
    batches = list(made.batches)
    return (
        made.facts,
        {name: np.concatenate([getattr(one, name) for one in batches]) for name in PARTS},
        [one.feet for one in batches],
    )


def joints(card, made):
    """Joints (M, F, J, 3), m."""
    bones, roots, rotations = (
        made[name].astype(float) for name in ("bone_offsets", "root_position", "rotations")
    )
    local = skeleton.translations(bones, roots)
    return skeleton.positions(card.skeleton.parents, rotations, local)


def skate(card, made, rate=RATE):
    feet = joints(card, made)[:, :, list(card.feet)]
    return walking_crowd.measure_skate_of_feet(card, feet, rate).mean()


def test_feet_of_walkers_stand(model, own):
    card = model.session.card
    facts, stood, feet = built(model, own)
    _, free, none = built(model, own, feet="as_predicted")
    assert facts["feet_stand"] and none == [None]
    before, after = skate(card, free), skate(card, stood)
    # Negative control: the prediction slides.
    assert after < 0.2 * before and before > 0.005
    (told,) = feet
    assert told.skate_before.mean() == pytest.approx(before, rel=1e-4)
    assert told.skate.mean() == pytest.approx(after, abs=1e-4)
    assert told.drift.max() < 1e-6 and 0.0 <= told.lowered.max() <= 0.05


def test_a_standing_foot_stays_in_one_place_on_the_floor(model, own):
    card = model.session.card
    _, stood, _ = built(model, own, count=3)
    _, free, _ = built(model, own, count=3, feet="as_predicted")
    heights = np.array([contact.height for contact in card.contacts])
    placed = joints(card, stood)[:, :, list(card.feet)]
    assert (placed[..., 1] - heights).min() > -0.01 - 1e-5
    free = joints(card, free)[:, :, list(card.feet)]
    level = [np.diff(paths[..., [0, 2]], axis=1) for paths in (placed, free)]
    still, slow = (np.linalg.norm(steps, axis=-1) < 2e-6 for steps in level)
    # Half of all frames or so, where the prediction has none.
    assert 0.3 < still.mean() < 0.8 and slow.mean() < 0.02


def test_crowds_with_few_frames_are_as_predicted_and_refuse_to_stand(model, own):
    facts, _, feet = built(model, own, count=2, fps=10.0)
    assert not facts["feet_stand"] and feet == [None]
    with pytest.raises(InvalidField, match="feet: 'stand' at 10 frames a second, expected 20"):
        built(model, own, count=2, fps=10.0, feet="stand")


def test_models_without_contacts_of_feet_are_as_predicted_and_refuse_to_stand(model):
    for changed in ({"contacts": ()}, {"feet": ()}):
        odd = with_card(model, **changed)
        walk = gait.fit_gait(odd.session)
        facts, _, feet = built(odd, walk, count=2)
        assert not facts["feet_stand"] and feet == [None]
        with pytest.raises(InvalidField, match="feet: 'stand', but this model knows no contacts"):
            built(odd, walk, count=2, feet="stand")
