"""Tests of walks that lead to an act: a part of the same walk, so that the poses fit exactly."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest

from posefield.inference import session
from posefield.locomotion import floor_plane
from posefield.performance import joins, standing_pose, walk_entries, walk_steps
from posefield.performance.act_motion import Act, StagedAct
from posefield.performance.passage import FloorMotion
from posefield.performance.script import resolve_script
from posefield.performance.timeline import Timeline
from posefield.question import json_decoding
from posefield.question.performance_question import PerformanceQuestion
from posefield.synthesis.synthesizer import Synthesizer

FRAMES = 60
# Distance of poses of one walk, m: those of the cycle lie between the frames of the plan.
FIT = 0.02


@pytest.fixture(scope="module")
def script(walk_path):
    """Two walks of one model; the second one's place is taken by an act."""
    walk = Synthesizer("walk", session.load(walk_path))
    own = {"kind": "walk", "model": "walk", "seconds": 2.0}
    content = msgspec.json.encode({"segments": [own, own]})
    asked = json_decoding.decode_question(PerformanceQuestion, content)
    return resolve_script(asked, lambda _: walk)


@pytest.fixture(scope="module")
def act(script):
    """An act that begins at a third of the cycle, turned and away from the origin."""
    source = script.sources[0]
    who = standing_pose.find_walker(source.gait, {}, {})
    controls = who.controls(np.array([float(source.gait.rates[:, 0].mean())]), np.zeros(1))
    cycle = walk_entries.cycle_passage(source.model, who, controls[0], FRAMES)
    moved = cycle.part(FRAMES // 3, FRAMES).placed(FloorMotion(0.7, 3.0 - 2.0j))
    return Act(moved, script.character.bones, None, None)


def lead(script, staged, before=False):
    """Return the plan and the placed act; before: whether the walk goes on from another one."""
    timeline = Timeline(script.character)
    if before:
        timeline.begin_with(staged.act.passage.placed(FloorMotion(-0.7, -2.0)))
        timeline.exits = range(len(timeline.done) - 1, len(timeline.done))
    entry = walk_entries.find_entry(timeline, script, 0)
    entry = replace(entry, request=replace(entry.request, seconds=None))
    return walk_steps.lead_to(timeline, script, 0, entry, staged)


def last_cut(script, plan, staged):
    """Return the cut from the last frame of a walk into the act where it was placed."""
    walked = script.adapted(0, walk_entries.walk_passage(script.sources[0].model, plan))
    placed = script.adapted(1, staged.act.passage.placed(staged.by))
    exits, entries = range(len(walked) - 1, len(walked)), walk_steps.entry_range(len(placed), None)
    body = script.character.body
    return (
        joins.find_cut(body, walked, placed, exits, entries),
        joins.find_cut(body, walked, placed, exits, entries, FloorMotion()),
    )


def assert_leads(script, plan, staged):
    free, given = last_cut(script, plan, staged)
    assert abs(free.motion.turn) < 2.0 * walk_steps.STRAIGHT
    assert given.distance < FIT
    # Negative controls: the act a step aside, and the walk that ends in another phase.
    aside = replace(staged, by=FloorMotion(0.0, 0.05j).after(staged.by))
    assert last_cut(script, plan, aside)[1].distance > FIT
    later = replace(plan, phases=plan.phases + 0.3)
    assert last_cut(script, later, staged)[1].distance > FIT


@pytest.mark.parametrize("end", [FloorMotion(0.4, 6.0 + 1.5j), FloorMotion(-0.9, 5.0 - 2.0j)])
def test_a_walk_ends_where_a_placed_act_goes_on(script, act, end):
    by = end.after(FloorMotion(-0.7, 0j))
    plan, staged = lead(script, StagedAct(1, act, by))
    assert staged.by == by
    assert_leads(script, plan, staged)


@pytest.mark.parametrize("goal", [4.0 - 1.0j, 5.0 + 2.0j])
def test_an_act_without_a_heading_faces_the_way_the_walk_comes(script, act, goal):
    turned = StagedAct(1, act, None, goal, lambda angle: act.motion_to(goal, angle))
    plan, staged = lead(script, turned)
    root = staged.by.place(act.passage.roots[:1])
    assert abs(complex(floor_plane.project(root)[0]) - goal) < 1e-9
    assert_leads(script, plan, staged)


def test_strides_change_by_a_share_at_most_where_a_walk_goes_on_from_another_motion(script, act):
    goal = 5.0 + 0.3j
    turned = StagedAct(1, act, None, goal, lambda angle: act.motion_to(goal, angle))
    plan, staged = lead(script, turned, before=True)
    steady = np.diff(plan.phases).mean() / np.diff(plan.distances).mean()
    free, _ = lead(script, turned)
    usual = np.diff(free.phases).mean() / np.diff(free.distances).mean()
    assert abs(steady / usual - 1.0) < walk_steps.MOST_CHANGED + 1e-3
    assert last_cut(script, plan, staged)[1].distance < 2.0 * FIT
