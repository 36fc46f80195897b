"""Tests of steps over joins: which feet step, and that feet then stand."""

from dataclasses import replace

import numpy as np
import pytest
from passages import FEET, PARENTS, character

from posefield.feet import body_plans, foot_placement
from posefield.feet.footsteps import PlanRequest
from posefield.motion import quat, skeleton
from posefield.motion.contact_detection import FootContact
from posefield.performance import join_quality, joins
from posefield.performance.joins import Cut
from posefield.performance.passage import RATE, FloorMotion, Passage

FRAMES = 90
CONTACTS = tuple(FootContact(foot, 0.04, 0.35, 0.5, 0.05) for foot in FEET)
CUT = Cut(60, 0, FloorMotion(), 0.0, 0.1)


def standing(spread=0.0, height=0.8):
    """A passage that stands still with its knees bent, and its legs spread."""
    rotations = np.tile(quat.IDENTITY, (FRAMES, len(PARENTS), 1))
    for hip, side in ((1, 1.0), (4, -1.0)):
        outwards = quat.exp(np.array([0.0, 0.0, side * spread]))
        rotations[:, hip] = quat.mul(outwards, quat.exp(np.array([-0.4, 0.0, 0.0])))
        rotations[:, hip + 1] = quat.exp(np.array([0.8, 0.0, 0.0]))
    roots = np.tile([0.0, height, 0.0], (FRAMES, 1))
    whole = Passage(rotations, roots, np.ones((FRAMES, 2)), np.zeros(FRAMES))
    return join_quality.on_floor(character(), whole, CONTACTS)[0]


def joined(before, after, cut=CUT):
    whole = joins.join(before, after, cut, "dead")
    return join_quality.add_steps(character(), before, after, cut, whole)


def slides(passage):
    """Largest way over the floor of each foot while it stands, after the plan."""
    motion = passage.rotations, passage.roots, RATE
    request = PlanRequest(character(), *motion, CONTACTS, passage.contacts)
    (plan,) = body_plans.plan_motions([request])
    times = np.arange(len(passage)) / RATE
    turned, roots = foot_placement.place_feet(plan, times, passage.rotations, passage.roots)
    moved = skeleton.translations(character().bones, roots)
    feet = skeleton.positions(PARENTS, turned, moved)[:, list(FEET)]
    found = []
    for foot, steps in enumerate(plan.steps):
        for stance in steps.stances:
            path = feet[stance.start : stance.stop, foot][:, [0, 2]]
            found.append(np.linalg.norm(path - path[0], axis=-1).max())
    return found


def test_feet_that_stand_apart_step_one_after_another():
    after = standing(0.1).placed(FloorMotion(0.0, 0.1 + 0.02j))
    found, steps = joined(standing(), after)
    assert sorted(step.foot for step in steps) == [0, 1]
    first, second = steps
    assert first.distance > second.distance > join_quality.FARTHEST
    assert (first.begin, first.end) == (60, 81)
    assert second.begin == first.end + 3
    up = found.contacts < 0.5
    assert not (up[:, 0] & up[:, 1]).any()
    assert up.sum(axis=0).tolist() == [21, 21]
    assert max(slides(found)) < 0.01
    # Without steps the feet would be pulled over the floor by the blend.
    plain = joins.join(standing(), after, CUT, "dead")
    moved = skeleton.positions(
        PARENTS, plain.rotations, skeleton.translations(character().bones, plain.roots)
    )[:, list(FEET)]
    assert np.linalg.norm(moved[-1] - moved[0], axis=-1).max() > 0.1


def test_feet_that_stand_nearly_where_they_stood_stay():
    found, steps = joined(standing(), standing().placed(FloorMotion(0.0, 0.03)))
    assert steps == ()
    assert (found.contacts == 1.0).all()
    _, far = joined(standing(), standing().placed(FloorMotion(0.0, 0.06)))
    assert len(far) == 2


def test_a_foot_that_swings_lands_when_it_is_near_its_place():
    before, after = standing(), standing(0.15)
    before.contacts[50:, 0] = 0.0
    found, steps = joined(before, after)
    assert 0 not in [step.foot for step in steps]
    lands = 60 + int(np.argmax(found.contacts[60:, 0]))
    assert 60 < lands < 60 + round(join_quality.LANDING * RATE)
    # The other foot waits until it has landed.
    (step,) = steps
    assert (step.foot, step.begin) == (1, lands)


def test_a_passage_is_brought_to_the_floor():
    raised = replace(standing(), roots=standing().roots + np.array([0.0, 0.03, 0.0]))
    found, by = join_quality.on_floor(character(), raised, CONTACTS)
    assert by == pytest.approx(-0.03)
    assert found.roots == pytest.approx(standing().roots)
    flying = replace(raised, contacts=np.zeros((FRAMES, 2)))
    assert join_quality.on_floor(character(), flying, CONTACTS)[1] == 0.0
    upstairs, by = join_quality.on_floor(character(), raised, CONTACTS, floor=0.5)
    assert by == pytest.approx(0.47)
    assert upstairs.roots[0, 1] == pytest.approx(standing().roots[0, 1] + 0.5)
