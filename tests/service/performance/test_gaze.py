"""Tests of the gaze: its direction, its limit, the shares of the joints, and bad input."""

from dataclasses import replace

import acting
import numpy as np
import pytest

from posefield.common.errors import InvalidField
from posefield.inference import session
from posefield.motion import quat, skeleton
from posefield.performance.acts import act_segment, gaze, hold_segment
from posefield.performance.acts.hold_segment import Hold
from posefield.question.motion_question import MotionQuestion
from posefield.synthesis.synthesizer import Synthesizer

AHEAD = np.array([0.0, 0.0, 1.0])


@pytest.fixture(scope="module")
def posed(model_path):
    """Looker of the reaching model and a pose: rotations (J, 4) and root (3,)."""
    model = acting.measured_reach(Synthesizer("reach", session.load(model_path)))
    act = act_segment.act_passage(model, MotionQuestion(controls={"target_height": 1.5}))
    body = acting.body(model, act.bones)
    return body, act.passage.part(0, 20)


def seen(body, rotations, root):
    """Place of the head and the direction in which it looks."""
    moved = skeleton.translations(body.bones, root[None])[0]
    places, turns = skeleton.forward_kinematics(body.parents, rotations, moved)
    head = body.joints["head"]
    return places[head], quat.rotate(turns[head], AHEAD)


def turned(body, own, point):
    rotations, root = own.rotations[-1], own.roots[-1]
    found = body.looker.look_at(rotations, root, np.array(point))
    after = found.add(body.parents, rotations[None], np.ones(1))[0]
    return found, after, root


@pytest.mark.parametrize("point", [(1.0, 1.6, 2.0), (-1.5, 1.0, 2.0), (0.2, 2.5, 2.0)])
def test_the_head_looks_at_the_point(posed, point):
    body, own = posed
    found, after, root = turned(body, own, point)
    place, direction = seen(body, after, root)
    away = (point - place) / np.linalg.norm(point - place)
    assert direction @ away > np.cos(np.radians(0.1))
    assert found.miss < np.radians(0.1)
    place, direction = seen(body, own.rotations[-1], root)
    away = (point - place) / np.linalg.norm(point - place)
    assert direction @ away < np.cos(np.radians(5.0))


def test_neck_head_and_a_part_of_the_trunk_turn(posed):
    body, own = posed
    found, after, _ = turned(body, own, (1.0, 1.6, 2.0))
    apart = 2.0 * np.arccos(np.clip(np.abs(np.sum(after * own.rotations[-1], axis=-1)), -1.0, 1.0))
    total = np.linalg.norm(found.turn)
    shares = {role: apart[body.joints[role]] / total for role in gaze.TRUNK + gaze.NECK}
    assert sum(shares[role] for role in gaze.TRUNK) == pytest.approx(gaze.TRUNK_SHARE, abs=1e-3)
    assert shares["neck"] == pytest.approx(shares["head"], abs=1e-3)
    rest = np.ones(len(apart), dtype=bool)
    rest[[body.joints[role] for role in shares]] = False
    assert np.all(apart[rest] < 1e-6)


@pytest.mark.parametrize("point", [(4.0, 1.5, -4.0), (0.0, 1.5, -4.0), (0.1, 9.0, 0.1)])
def test_the_neck_turns_no_farther_than_it_can(posed, point):
    body, own = posed
    found, after, root = turned(body, own, point)
    place, direction = seen(body, after, root)
    away = (point - place) / np.linalg.norm(point - place)
    beside = np.arccos(np.clip(direction @ away, -1.0, 1.0))
    assert beside == pytest.approx(found.miss, abs=np.radians(0.1))
    assert found.miss > np.radians(5.0)


def test_the_gaze_turns_and_comes_back_smoothly(posed):
    body, own = posed
    point = (2.0, 1.6, 2.0)
    held = hold_segment.hold_passage(own, Hold(2.0, look_at=point), body)
    still = hold_segment.hold_passage(own, Hold(2.0), body).passage
    directions = [
        seen(body, *pair)[1] @ seen(body, *rest)[1]
        for pair, rest in zip(
            zip(held.passage.rotations, held.passage.roots, strict=True),
            zip(still.rotations, still.roots, strict=True),
            strict=True,
        )
    ]
    angles = np.degrees(np.arccos(np.clip(directions, -1.0, 1.0)))
    assert angles[0] < 0.5
    assert angles[-1] < 0.5
    assert angles[60] > 20.0
    assert np.abs(np.diff(angles)).max() < 5.0
    assert held.miss < np.radians(0.1)


def test_a_skeleton_without_a_head_is_refused(posed):
    body, own = posed
    blind = replace(body, joints={k: v for k, v in body.joints.items() if k != "head"})
    with pytest.raises(InvalidField, match=r"^look_at: no joint has the role of the head"):
        hold_segment.hold_passage(own, Hold(1.0, look_at=(0.0, 1.6, 3.0)), blind)


def test_a_point_at_the_head_is_refused(posed):
    body, own = posed
    place, _ = seen(body, own.rotations[-1], own.roots[-1])
    near = tuple(place + 0.01)
    with pytest.raises(InvalidField, match=r"^look_at: 0\.0\d+ m from the head, expected at least"):
        hold_segment.hold_passage(own, Hold(1.0, look_at=near), body)
    with pytest.raises(InvalidField, match=r"^look_at/1: inf, expected a finite number"):
        hold_segment.hold_passage(own, Hold(1.0, look_at=(0.0, float("inf"), 0.0)), body)
