"""Knees and elbows of the shipped walk keep the limits of its predictions in every answer."""

from dataclasses import replace

import numpy as np
import pytest
from limited_models import excess, known_limits, questions

from posefield.motion import hinges
from posefield.motion.hinges import MOST
from posefield.question.motion_question import Target
from posefield.synthesis import clips
from posefield.synthesis.synthesizer import Synthesizer

STEP = 1e-5


@pytest.fixture(scope="module")
def limited(shipped_walk):
    return known_limits(shipped_walk)


def test_predicted_clips_within_the_limits_are_the_same(limited, shipped_walk):
    asked = questions(limited.session.card, feet="predicted")
    with_limits, without = (clips.synthesize_clips(m, asked) for m in (limited, shipped_walk))
    for one, other in zip(with_limits, without, strict=True):
        assert one.clip.rotations.tobytes() == other.clip.rotations.tobytes()


@pytest.mark.parametrize("feet", ["predicted", "stand"])
def test_takes_and_standing_feet_keep_the_limits(limited, shipped_walk, feet):
    asked = questions(limited.session.card, feet=feet, take=lambda row: row + 1, variety=1.0)
    limits = hinges.from_card(limited.session.card.hinges)
    # Limits are those of the card, and some rounding: leg lengths differ between performers.
    assert (excess(limits, clips.synthesize_clips(limited, asked)) < MOST + 1e-3).all()
    # Negative control: a model without limits.
    unlimited = replace(shipped_walk.session.card, hinges=())
    free = Synthesizer("free", replace(shipped_walk.session, card=unlimited))
    assert excess(limits, clips.synthesize_clips(free, asked)).max() > 3.0 * MOST


def test_targets_are_met_within_the_limits(limited):
    """A hand is led aside, and up so far that its elbow would bend by more than in any clip."""
    card = limited.session.card
    hand = card.roles["rightHand"]
    (plain,) = clips.synthesize_clips(limited, questions(card, 1, feet="predicted"))
    place = plain.clip.positions()[10, card.skeleton.names.index(hand)]

    def led(model, offset):
        """Return the distance of the hand from a place beside that of the prediction, m."""
        goal = Target(joint=hand, position=tuple(place + np.array(offset)), time=10 / 30.0)
        asked = questions(card, 1, targets=[goal], take=2, variety=1.0)
        (answer,) = clips.synthesize_clips(model, asked)
        limits = hinges.from_card(model.session.card.hinges)
        assert (excess(limits, [answer]) < MOST + 1e-3).all()
        return answer.trust.targets[-1].miss

    assert led(limited, (0.05, 0.0, 0.0)) < 1e-3
    # In a narrow range the target cannot be met, and the answer tells so.
    narrow, far = known_limits(limited, 0.55), (0.0, 0.1, 0.08)
    assert led(narrow, far) > led(limited, far) + 0.01


def test_gradients_are_those_of_limited_motions(limited, rng):
    """Oracle: central differences, at a take whose knee is beyond its free range."""
    narrow = known_limits(limited, 0.5)
    card = narrow.session.card
    foot = card.skeleton.names.index(card.roles["leftFoot"])
    (asked,) = questions(card, 1)
    question = narrow.question(asked)
    motion = narrow.solver.solve(question, clips.NO_CONSTRAINTS)
    unlimited = limited.solver.solve(question, clips.NO_CONSTRAINTS)
    scene, numbers = motion.scene, motion.numbers
    for frame in (20.0, 60.0, 75.0):
        rotations, _ = motion.poses(np.array([frame]))
        assert not np.array_equal(rotations, unlimited.poses(np.array([frame]))[0])
        _, gradient = scene.position_and_gradient(numbers, foot, frame)
        way = rng.standard_normal(len(numbers))
        ends = [
            scene.position_and_gradient(numbers + sign * STEP * way, foot, frame)[0]
            for sign in (1.0, -1.0)
        ]
        slope = (ends[0] - ends[1]) / (2.0 * STEP)
        assert gradient @ way == pytest.approx(slope, abs=0.02 * np.linalg.norm(slope))
