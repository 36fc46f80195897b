"""Tests of the steps with which walks begin and end standing, with the shipped walk."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import msgspec
import numpy as np
import pytest

from posefield.inference import session
from posefield.motion import skeleton
from posefield.performance import (
    composition,
    joins,
    standing_pose,
    walk_entries,
    walk_plan,
    walk_steps,
)
from posefield.performance.act_motion import Act, StagedAct
from posefield.performance.passage import RATE, FloorMotion
from posefield.performance.script import resolve_script
from posefield.performance.standing_pose import find_walker
from posefield.performance.timeline import Timeline
from posefield.performance.walk_plan import plan_walk
from posefield.performance.walk_request import WalkRequest
from posefield.question import json_decoding
from posefield.question.performance_question import PerformanceQuestion
from posefield.synthesis.synthesizer import Synthesizer

SHIPPED = Path(__file__).parents[3] / "service/posefield/shipped/cmu_walk.onnx"
BOTH = {"start": "standing", "stop": "standing"}
LAST = round(walk_plan.STEP_END * RATE)  # Frames of an opening or closing step.


@cache
def walk():
    return Synthesizer("cmu_walk", session.load(SHIPPED))


@cache
def pose():
    return standing_pose.find_standing_pose(find_walker(walk().gait, {}, {}))


def joints(passage):
    """Return the positions (F, J, 3) of the joints of a passage."""
    own = pose()
    local = skeleton.translations(own.bones, passage.roots)
    return skeleton.positions(own.parents, passage.rotations, local)


def balls(passage):
    """Return the paths (F, 2, 3) of the balls of the feet, m."""
    return joints(passage)[:, [leg.tip for leg in pose().legs]]


def accelerations(passage):
    """Return the mean accelerations of the joints relative to the root, m/s²."""
    found = joints(passage) - passage.roots[:, None]
    return np.linalg.norm(np.diff(found, n=2, axis=0), axis=-1).mean(axis=-1) * RATE**2


def walked(request, phase=0.1):
    plan = plan_walk(walk().gait, request, FloorMotion(), phase)
    return plan, walk_entries.walk_passage(walk(), plan)


def test_the_standing_pose_has_its_feet_beside_each_other():
    own = pose()
    (still,) = {array.tobytes() for array in walk_entries.still(own).rotations}
    assert still == own.rotations.tobytes()
    feet = balls(walk_entries.still(own))[0]
    apart = feet[0] - feet[1]
    assert abs(apart[2]) < 1e-9
    assert 0.1 < abs(apart[0]) < 0.2
    assert np.abs(feet[:, 1] - own.levels).max() < 1e-9
    # The root is between the feet, and ahead of the ankles by less than the balls are.
    assert feet[:, 0].mean() == pytest.approx(own.place.imag, abs=1e-9)
    assert 0.03 < feet[0, 2] - own.place.real < 0.15


def test_a_model_without_contacts_has_none_and_slows_down():
    known = walk().gait
    card = replace(known.session.card, contacts=())
    own = replace(known, session=replace(known.session, card=card, digest="without contacts"))
    assert standing_pose.find_standing_pose(find_walker(own, {}, {})) is None
    plan = plan_walk(own, WalkRequest(1.0, seconds=5.0, **BOTH), None, 0.0)
    assert (plan.steps, plan.closes) == (None, False)
    assert [note.code for note in plan.notes].count("feet-apart") == 2
    assert "synthesised" in plan.notes[0].message
    assert plan.notes[0].code.startswith(walk_plan.SYNTHESISED)


@pytest.mark.parametrize("length", [3.0, 5.3, 8.0])
@pytest.mark.parametrize("end", ["start", "stop"])
def test_a_walk_begins_and_ends_with_its_feet_beside_each_other(length, end):
    plan, made = walked(WalkRequest(1.1, to=(0.0, length), **BOTH))
    frame, place = (0, 0.0) if end == "start" else (-1, length)
    feet = balls(made)[frame]
    assert abs(feet[0, 2] - feet[1, 2]) < 0.01
    assert 0.1 < abs(feet[0, 0] - feet[1, 0]) < 0.2
    assert np.abs(feet[:, 1] - pose().levels).max() < 0.005
    root = made.roots[frame]
    assert np.hypot(root[0], root[2] - place) < 0.06
    assert root[0] == pytest.approx(feet[:, 0].mean(), abs=0.01)
    # Without the steps one foot is in the air or ahead.
    found = balls(walk_entries.walk_passage(walk(), replace(plan, steps=None)))[frame]
    assert max(np.abs(found[:, 1] - pose().levels).max(), abs(found[0, 2] - found[1, 2])) > 0.1


def test_a_closing_step_lifts_one_foot_and_stands_on_the_other():
    made = walked(WalkRequest(1.1, to=(0.0, 6.0), stop="standing"))[1]
    down = made.contacts[-LAST:] > 0.5
    swinging = int(np.argmin(down.sum(axis=0)))
    assert down[:, 1 - swinging].all()
    swing = np.flatnonzero(~down[:, swinging])
    assert 0.25 < len(swing) / RATE < 0.65
    assert down[swing[-1] + 1 :, swinging].all()
    clip = performed({"kind": "walk", "to": [0, 6], "speed": 1.1, "stop": "standing"}).clip
    feet = clip.positions()[-LAST:, [leg.tip for leg in pose().legs]]
    assert feet[swing, swinging, 1].max() > pose().levels[swinging] + 0.03
    moved = np.linalg.norm(np.diff(feet[:, :, [0, 2]], axis=0), axis=-1).sum(axis=0)
    assert moved[1 - swinging] < 0.03
    assert moved[swinging] > 0.3
    # At the end neither the root nor the feet move.
    assert np.linalg.norm(np.diff(made.roots[-3:], axis=0), axis=-1).max() * RATE < 0.03
    assert np.abs(feet[-5:] - feet[-1]).max() < 1e-3


def test_steps_are_no_more_sudden_than_walking():
    made = walked(WalkRequest(1.1, to=(0.0, 8.0), **BOTH))[1]
    found = accelerations(made)
    usual = np.percentile(found[LAST:-LAST], 99.0)
    assert max(found[:LAST].max(), found[-LAST:].max()) < usual
    # A pose that is put at the end is seen.
    still = walk_entries.still(pose()).rotations[0]
    sudden = made.rotations.copy()
    sudden[-LAST:] = still
    assert accelerations(replace(made, rotations=sudden)).max() > usual
    # Knees turn smoothly, too.
    places = [walk().session.card.skeleton.names.index(name) for name in ("LeftLeg", "RightLeg")]
    bends = np.degrees(2.0 * np.arccos(np.abs(made.rotations[:, places, 0])))
    bent = np.abs(np.diff(bends, n=2, axis=0)).max(axis=1)
    assert max(bent[:LAST].max(), bent[-LAST:].max()) < bent[LAST:-LAST].max()


def performed(*segments):
    document = {"fps": RATE, "segments": [{"model": "cmu_walk", **own} for own in segments]}
    asked = json_decoding.decode_question(PerformanceQuestion, msgspec.json.encode(document))
    return composition.perform(resolve_script(asked, lambda _: walk()), 10_000)


@pytest.mark.parametrize("speed", [0.6, 1.3])
def test_placed_feet_skate_no_more_in_starts_and_stops(speed):
    way = {"kind": "walk", "to": [0, 10], "speed": speed}
    steady, both = performed(way).trust, performed(way | BOTH).trust
    assert both.feet.skate < 1.1 * steady.feet.skate
    assert both.feet.lowered < 0.045
    assert both.script_warnings == ()
    assert len(both.segments[0].notes) == 2


@pytest.mark.parametrize("way", [6.0, 6.5])
def test_an_act_goes_on_from_where_a_walk_stands(way):
    own = {"kind": "walk", "model": "cmu_walk", "seconds": 2.0, "stop": "standing"}
    content = msgspec.json.encode({"segments": [own, own]})
    asked = json_decoding.decode_question(PerformanceQuestion, content)
    script = resolve_script(asked, lambda _: walk())
    still = walk_entries.still(pose())
    act = Act(still.placed(FloorMotion(0.7, 3.0 - 2.0j)), script.character.bones, None, None)
    place = FloorMotion(-0.5, way + 1.0j)
    timeline = Timeline(script.character)
    entry = walk_entries.find_entry(timeline, script, 0)
    entry = replace(entry, request=replace(entry.request, seconds=None))
    plan, staged = walk_steps.lead_to(timeline, script, 0, entry, StagedAct(1, act, place))
    assert plan.closes
    stood = script.adapted(0, walk_entries.walk_passage(walk(), plan))
    last = range(len(stood) - 1, len(stood))
    body, placed = script.character.body, act.passage.placed(staged.by)
    found = joins.find_cut(body, stood, placed, last, range(1), FloorMotion())
    assert found.distance < 0.02
    aside = placed.placed(FloorMotion(0.0, 0.05j))
    moved = joins.find_cut(body, stood, aside, last, range(1), FloorMotion())
    assert moved.distance > 0.03
