"""Performances: one motion of all segments of a script, its feet, and the report about it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import orjson

from posefield.common import cancellation
from posefield.common.errors import InvalidField
from posefield.common.units import Frames, RootPath, Rotations
from posefield.feet import body_plans, foot_placement
from posefield.feet.footsteps import FeetPlan, SampledMotion
from posefield.motion import joint_roles, quat
from posefield.motion.clip import Clip, assemble
from posefield.performance import acts, holds, join_quality, limb_targets, reporting, walk_steps
from posefield.performance.act_motion import StagedAct
from posefield.performance.join_quality import JoinFacts
from posefield.performance.passage import RATE, Passage
from posefield.performance.script import Script, errors_under
from posefield.performance.timeline import Composed, Timeline, from_poses, resample
from posefield.question.performance_question import Act, Hold, Walk
from posefield.question.performance_report import (
    HeldJoint,
    PerformanceAnswer,
    PerformanceReport,
)
from posefield.question.results import FeetResult
from posefield.synthesis import standing_feet


def plan(script: Script, most: int) -> PerformanceReport:
    """Return the report of a performance without its poses. most: largest number of frames.

    Raises QueryError with a pointer into the script.
    """
    composed = compose(script)
    times = frame_times(composed, script.question.fps, most)
    joins = _judge_joins(script, composed, composed.motion)
    return reporting.report(script, composed, joins, len(times), None)


def perform(script: Script, most: int) -> PerformanceAnswer:
    """Return the performance of a script as one clip. most: largest number of frames.

    Raises QueryError with a pointer into the script.
    """
    composed = compose(script)
    times = frame_times(composed, script.question.fps, most)
    told: FeetResult | None = None
    planned: FeetPlan | None = None
    every = composed.motion
    if script.question.feet == "stand" and script.character.feet:
        planned = plan_feet(script, composed)
        (told,) = standing_feet.describe([planned], script.character.skeleton.names)
        even = np.arange(len(composed.motion)) / RATE
        rotations, roots = foot_placement.place_feet(planned, even, every.rotations, every.roots)
        every = replace(every, rotations=rotations, roots=roots)
    judged = _judge_joins(script, composed, every)
    rotations, roots = _at_times(script, composed.motion, planned, every, times)
    character = script.character
    joints = joint_roles.rename_joints(character.skeleton, character.roles, script.question.names)
    turns = quat.normalize(rotations)
    own = script.question
    bone = own.root == "bone" or (own.root is None and own.names == "ue5")
    clip = replace(assemble(joints, turns, roots, character.bones, own.fps), root_bone=bone)
    report = reporting.report(script, composed, judged, len(clip), told)
    return PerformanceAnswer(clip, report, _held_joints(composed.timeline, clip))


def _held_joints(timeline: Timeline, clip: Clip) -> tuple[HeldJoint, ...]:
    """Return the targets within a performance."""
    found = []
    for own in timeline.targets:
        begins, ends = ((frame - timeline.begin) / RATE for frame in (own.begin, own.end))
        if ends >= 0.0 and begins <= clip.duration:
            x, y, z = own.position.tolist()
            times = max(begins, 0.0), min(ends, clip.duration)
            found.append(HeldJoint(clip.skeleton.names[own.joint], *times, (x, y, z)))
    return tuple(found)


def _judge_joins(script: Script, composed: Composed, every: Passage) -> Sequence[JoinFacts]:
    """Judge the joins as they are sent: with targets met, and feet placed where they stand.

    Each hard one has a warning, and so has each act that is too fast.
    """
    timeline = composed.timeline
    joins = [(own.frame - timeline.begin, own.cut) for own in timeline.joins]
    found = join_quality.judge(script.character.body, joins, every)
    for made, facts in zip(timeline.joins, found, strict=True):
        if facts.hard:
            timeline.warn(f"/segments/{made.segment}", "; ".join(facts.reasons))
    # Acts may be faster than captured clips, as extrapolated ones are.
    ends = [*(span.begin for span in timeline.spans[1:]), len(timeline.done)]
    for index, (span, end) in enumerate(zip(timeline.spans, ends, strict=True)):
        if span.kind != "act" or not timeline.captured:
            continue
        frames = (span.begin - timeline.begin, end - timeline.begin)
        body, captured = script.character.body, timeline.captured[index]
        said = join_quality.judge_act(body, every, frames, captured)
        if said:
            timeline.warn(f"/segments/{index}", said)
    return found


def plan_document(report: PerformanceReport) -> bytes:
    """Return a plan as JSON."""
    return orjson.dumps({"trust": report.document()})


def compose(script: Script) -> Composed:
    """Return the motion of all segments, joined one after another."""
    timeline = Timeline(script.character, _captured_accelerations(script))
    if script.question.start.poses:
        poses = script.question.start.poses
        timeline.begin_with_given(from_poses(poses, script.question.fps, script.character))
    staged: StagedAct | None = None
    for index, own in enumerate(script.segments):
        cancellation.check()
        ahead = _stage_ahead(script, index)
        with errors_under("segments", index):
            if isinstance(own, Walk):
                staged = walk_steps.add_walk(timeline, script, index, ahead)
            elif isinstance(own, Hold):
                holds.add_hold(timeline, script, index)
            else:
                act = staged or acts.stage_at_join(timeline, script, index)
                acts.add_act(timeline, script, act)
                staged = None
            timeline.check_duration()
    motion, missed = limb_targets.meet_targets(
        script.character.body, timeline.done, timeline.targets
    )
    return Composed(motion.part(timeline.begin, len(motion)), timeline, missed)


def _captured_accelerations(script: Script) -> tuple[float, ...]:
    """Return `Timeline.captured`, zero for holds."""
    found = []
    for own in script.sources:
        known = None if own is None else own.model.session.card.captured_acceleration
        if own is not None and known is None:
            return ()
        found.append(0.0 if known is None else known.p99)
    return tuple(found)


def _stage_ahead(script: Script, index: int) -> StagedAct | None:
    """Return the act that a walk without an end of its own leads to; None for other segments.

    Its errors are of the act's segment.
    """
    own = script.segments[index]
    if not isinstance(own, Walk) or any(
        end is not None for end in (own.along, own.to, own.seconds)
    ):
        return None
    following = script.segments[index + 1] if index + 1 < len(script.segments) else None
    if not isinstance(following, Act) or (
        following.at is None and not acts.world_targets(following)
    ):
        raise InvalidField(
            f"segments/{index}",
            "a walk without along, to or seconds, expected one of them, or an act with a place "
            "after it: at, or a target in the world",
        )
    with errors_under("segments", index + 1):
        return acts.stage_after_walk(script, index + 1)


def frame_times(composed: Composed, fps: float, most: int) -> Frames:
    """Return the times (F,), s, of the frames; InvalidField for more than `most`."""
    seconds = (len(composed.motion) - 1) / RATE
    count = int(seconds * fps + 1e-6) + 1
    if count > most:
        raise InvalidField(
            "segments", f"{count} frames at {fps:g} a second, expected at most {most}"
        )
    return np.arange(count) / fps


def plan_feet(script: Script, composed: Composed) -> FeetPlan:
    """Return the plan of the feet over a whole performance, in which targets stay met."""
    character, timeline, own = script.character, composed.timeline, composed.motion
    frames = range(timeline.begin, timeline.begin + len(own))
    body, led = limb_targets.find_leads(character.body, timeline.targets, frames)
    motion = SampledMotion(own.rotations, own.roots, RATE, walking=composed.walking)
    return body_plans.plan_feet(body, motion, script.contacts, own.contacts, led=led)


def _at_times(
    script: Script, motion: Passage, planned: FeetPlan | None, every: Passage, times: Frames
) -> tuple[Rotations, RootPath]:
    """Return rotations and roots at the times (F,), s, of the clip, with placed feet.

    every: the motion at `RATE` with placed feet. Times between its frames have feet placed anew.
    """
    step = round(RATE / script.question.fps)
    if step * script.question.fps == RATE:
        rows = slice(0, step * len(times), step)
        return every.rotations[rows], every.roots[rows]
    rotations, roots = resample(motion.rotations, motion.roots, RATE, times)
    if planned is None:
        return rotations, roots
    return foot_placement.place_feet(planned, times, rotations, roots)
