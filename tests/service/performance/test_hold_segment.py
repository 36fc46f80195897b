"""Tests of holds: rest, sway, a joint that stays, and bad input."""

from dataclasses import replace

import acting
import changed_cards
import numpy as np
import pytest

from posefield.common.errors import InvalidField
from posefield.inference import session
from posefield.motion import quat, skeleton
from posefield.performance import act_motion, holds
from posefield.performance.passage import RATE, Passage, concatenate
from posefield.question.motion_question import MotionQuestion
from posefield.synthesis.synthesizer import Synthesizer

STILL = 1e-4
"""Distance, m, within which a held joint stays."""


@pytest.fixture(scope="module")
def reach(model_path):
    return changed_cards.measured_reach(Synthesizer("reach", session.load(model_path)))


@pytest.fixture(scope="module")
def act(reach):
    return act_motion.act_passage(reach, MotionQuestion(controls={"target_height": 1.5}))


@pytest.fixture(scope="module")
def rested(act):
    return holds.come_to_rest(act.passage.part(0, act.event - 5))


@pytest.fixture(scope="module")
def body(reach, act):
    return acting.body(reach, act.bones)


def path(reach, act, passage, name):
    joint = reach.session.card.skeleton.names.index(name)
    return acting.positions(reach, passage, act.bones)[:, joint]


def line(frames, speed=1.0):
    """A body of one joint that moves ahead, m/s, and turns by as many rad/s."""
    gone = speed * np.arange(frames) / RATE
    turns = quat.from_axis_angle(np.array([0.0, 1.0, 0.0]), gone)[:, None]
    roots = np.stack([np.zeros(frames), np.ones(frames), gone], axis=1)
    return Passage(turns, roots, np.zeros((frames, 1)), np.full(frames, 0.1))


def test_a_motion_comes_to_rest_in_its_last_pose():
    own = line(40)
    found = holds.come_to_rest(own)
    assert len(found) == 40 + holds.REST_FRAMES // 2
    assert np.allclose(found.roots[-1], own.roots[-1], atol=1e-9)
    assert np.allclose(found.rotations[-1], own.rotations[-1], atol=1e-9)
    speeds = np.linalg.norm(np.diff(found.roots, axis=0), axis=-1) * RATE
    assert speeds[30] == pytest.approx(1.0, abs=0.02)
    assert speeds[-1] < 0.01
    assert np.all(np.diff(speeds) < 1e-9)
    # The largest deceleration of 1 - 3 u^2 + 2 u^3 over its time.
    steepest = 1.5 * RATE / holds.REST_FRAMES
    assert np.abs(np.diff(speeds)).max() * RATE == pytest.approx(steepest, rel=0.02)
    turned = quat.twist(found.rotations[:, 0], np.array([0.0, 1.0, 0.0]))
    assert np.allclose(turned, found.roots[:, 2], atol=1e-9)


def test_a_held_hand_stays_while_the_body_sways(reach, act, rested, body):
    found = holds.hold_passage(rested, body, 3.0, "RightHand", seed=3)[0]
    assert len(found) == 180
    place = path(reach, act, rested, "RightHand")[-1]
    hand = path(reach, act, found, "RightHand")
    assert np.linalg.norm(hand - place, axis=-1).max() < STILL
    head = path(reach, act, found, "Head")
    assert 0.002 < np.linalg.norm(head - head[0], axis=-1).max() < 0.05
    # The hand of a body that only sways does not stay.
    free = holds.hold_passage(rested, body, 3.0, seed=3)[0]
    moved = path(reach, act, free, "RightHand")
    assert np.linalg.norm(moved - place, axis=-1).max() > 10.0 * STILL


def test_a_hold_begins_and_ends_in_its_pose_without_a_jump(reach, act, rested, body):
    asked = 1.0, "RightHand", (2.0, 1.6, 3.0), 3
    found, _ = holds.hold_passage(rested, body, *asked)
    assert np.allclose(found.roots[-1], rested.roots[-1], atol=1e-12)
    dots = np.abs(np.sum(found.rotations[-1] * rested.rotations[-1], axis=-1))
    assert np.allclose(dots, 1.0, atol=1e-9)
    whole = concatenate(rested, found)
    own, after = (
        np.linalg.norm(np.diff(acting.positions(reach, passage, act.bones), 2, axis=0), axis=-1)
        .mean(axis=-1)
        .max()
        * RATE**2
        for passage in (rested, whole)
    )
    assert after <= own + 1e-9
    # Without coming to rest the motion stops at once.
    cut = act.passage.part(0, act.event - 5)
    stopped = concatenate(cut, holds.hold_passage(cut, body, *asked)[0])
    x = acting.positions(reach, stopped, act.bones)
    assert np.linalg.norm(np.diff(x, 2, axis=0), axis=-1).mean(axis=-1).max() * RATE**2 > own


AHEAD = np.array([0.0, 0.0, 1.0])


@pytest.fixture(scope="module")
def posed(body, act):
    return body, act.passage.part(0, 20)


def seen(body, rotations, root):
    """Place of the head and the direction in which it looks."""
    moved = skeleton.translations(body.bones, root[None])[0]
    places, turns = skeleton.forward_kinematics(body.parents, rotations, moved)
    head = body.joints["head"]
    return places[head], quat.rotate(turns[head], AHEAD)


def turned(body, own, point):
    rotations, root = own.rotations[-1], own.roots[-1]
    found = body.look_at(rotations, root, np.array(point))
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
    shares = {role: apart[body.joints[role]] / total for role in holds.TRUNK + holds.NECK}
    trunk = sum(shares[role] for role in holds.TRUNK)
    assert trunk == pytest.approx(holds.TRUNK_SHARE, abs=1e-3)
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
    held, miss = holds.hold_passage(own, body, 2.0, look_at=point)
    still = holds.hold_passage(own, body, 2.0)[0]
    directions = [
        seen(body, *pair)[1] @ seen(body, *rest)[1]
        for pair, rest in zip(
            zip(held.rotations, held.roots, strict=True),
            zip(still.rotations, still.roots, strict=True),
            strict=True,
        )
    ]
    angles = np.degrees(np.arccos(np.clip(directions, -1.0, 1.0)))
    assert angles[0] < 0.5
    assert angles[-1] < 0.5
    assert angles[60] > 20.0
    assert np.abs(np.diff(angles)).max() < 5.0
    assert miss < np.radians(0.1)


def test_a_gaze_of_no_head_or_at_the_head_is_refused(posed):
    body, own = posed
    blind = replace(body, joints={k: v for k, v in body.joints.items() if k != "head"})
    place, _ = seen(body, own.rotations[-1], own.roots[-1])
    for who, point, said in (
        (blind, (0.0, 1.6, 3.0), r"^look_at: no joint has the role of the head"),
        (body, tuple(place + 0.01), r"^look_at: 0\.0\d+ m from the head, expected at least"),
    ):
        with pytest.raises(InvalidField, match=said):
            holds.hold_passage(own, who, 1.0, look_at=point)
