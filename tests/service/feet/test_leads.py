"""Feet and limbs that are led: exactly where the motion has them, and planned around it."""

import numpy as np
import pytest
from test_footsteps import FEET, FRAMES, alternating, body, contact, feet_of, placed, sliding

from posefield.feet import body_plans, leads
from posefield.feet.leads import Led
from posefield.feet.stances import Interval
from posefield.motion import quat

KICK = 30


def led_at(frames, foot=0, limbs=0):
    """Lead one of the four feet in some frames."""
    found = leads.always(4, limbs, FRAMES)
    found.feet[foot, frames] = True
    return found


def kicking():
    """The sliding motion, in which the first leg is lifted high around a frame."""
    motion = sliding()
    share = np.exp(-0.5 * np.square((np.arange(FRAMES) - KICK) / 6.0))
    motion.rotations[:, 1] = quat.exp(share[:, None] * [-1.2, 0.0, 0.0] + [-0.3, 0.0, 0.0])
    return motion


def planned(motion, led=None):
    known = [contact(sliding(), foot) for foot in FEET]
    return body_plans.plan_feet(body(), motion, known, alternating(), led=led)


def test_a_led_foot_is_where_the_motion_has_it_and_stands_before_and_after():
    motion = kicking()
    plan = planned(motion, led_at([KICK]))
    feet, wanted = feet_of(placed(motion, plan)), feet_of(motion)
    assert np.linalg.norm(feet[KICK, 0] - wanted[KICK, 0]) < 1e-9
    # Half a captured swing before the kick and after it the foot does not stand.
    stances = plan.steps[0].stances
    assert [own.end <= KICK - 9 or own.begin > KICK + 9 for own in stances] == [True, True]
    assert plan.steps[0].anchors[:, 1] == pytest.approx(0.04, abs=0.02)
    for stance, anchor in zip(stances, plan.steps[0].anchors, strict=True):
        assert np.abs(feet[stance.begin : stance.end, 0] - anchor).max() < 1e-9
    assert feet[:, 0, 1].min() > plan.steps[0].anchors[0, 1] - 1e-9
    # A foot that is not led is elsewhere, and one that is never planned slides.
    free = feet_of(placed(motion, planned(motion)))
    assert np.linalg.norm(free[KICK, 0] - wanted[KICK, 0]) > 1e-3
    assert np.abs(wanted[:15, 0] - wanted[0, 0]).max() > 0.05


def test_a_foot_that_is_led_on_the_floor_stands_there():
    motion = sliding()
    plan = planned(motion, led_at([10]))
    wanted = feet_of(motion)[10, 0]
    (stance,) = (own for own in plan.steps[0].stances if own.begin <= 10 < own.end)
    assert stance == Interval(0, 20)
    assert plan.steps[0].anchors[0] == pytest.approx(wanted, abs=1e-9)
    assert planned(motion).steps[0].anchors[0] != pytest.approx(wanted, abs=1e-3)


def test_the_pelvis_is_lowered_no_more_than_a_led_limb_reaches():
    motion = kicking()
    plan = planned(motion, led_at([KICK]))
    _, below = plan.led.room(plan.poses, plan.character.limbs)
    assert np.isinf(below).sum() == FRAMES - 1
    assert plan.lowered[KICK] <= below[KICK] + 1e-12
    root = leads.always(4, 0, FRAMES)
    root.root[KICK] = True
    still = planned(motion, root)
    assert still.lowered[KICK] == 0.0


def test_limbs_keep_their_ends_as_far_as_they_are_led():
    motion = sliding(0.77)
    motion.roots[:, 1] += 0.03 * np.sin(np.arange(FRAMES) / 10.0)
    known = [contact(motion, foot) for foot in FEET[1:]]
    character = body(FEET, held=[FEET[0]])
    (kept,) = character.kept
    share = np.clip(np.abs(np.arange(FRAMES) - 45.0) / 20.0, 0.0, 1.0)[None]
    likely = alternating()[:, 1:]
    plan = body_plans.plan_feet(
        character,
        motion,
        known,
        likely,
        led=Led(np.zeros((3, FRAMES), bool), share, np.zeros(FRAMES, bool)),
    )
    assert plan.lowered.max() > 0.001
    moved = feet_of(placed(motion, plan))[:, FEET.index(kept.tip)] - feet_of(motion)[:, 0]
    assert -moved[:, 1] == pytest.approx((1.0 - share[0]) * plan.lowered, abs=1e-3)
    always = body_plans.plan_feet(character, motion, known, likely)
    own = feet_of(placed(motion, always))[:, 0] - feet_of(motion)[:, 0]
    assert np.abs(own).max() < 1e-6
