"""Performances: one motion of all segments of a script, its feet, and the report about it."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Annotated, Any

import numpy as np
import orjson
from threadpoolctl import threadpool_limits

from posefield.common import cancellation
from posefield.common.errors import InvalidField
from posefield.common.units import Floats, Frames, RootPath, Rotations
from posefield.constraints.gauss_newton import MISS_TOLERANCE
from posefield.feet import body_plans, foot_placement
from posefield.feet.footsteps import FeetPlan, PlanRequest
from posefield.locomotion import floor_plane
from posefield.locomotion.floor_plane import FloorVectors
from posefield.motion import hinges, joint_roles, quat
from posefield.motion.clip import Clip, assemble
from posefield.performance import acts, holds, join_quality, limb_targets, walk_steps
from posefield.performance.act_motion import StagedAct
from posefield.performance.join_quality import JoinFacts
from posefield.performance.passage import RATE, Passage
from posefield.performance.script import Script, errors_under
from posefield.performance.timeline import VISIBLE, Span, Timeline, from_poses, resample
from posefield.performance.walk_plan import WalkPlan
from posefield.question.performance_question import Act, Hold, Walk
from posefield.question.performance_report import (
    HeldJoint,
    JoinReport,
    PathReport,
    PerformanceAnswer,
    PerformanceReport,
    ScriptWarning,
    SegmentReport,
)
from posefield.question.results import ConstraintResult, FeetResult, round_micrometres
from posefield.synthesis import clip_draft, standing_feet
from posefield.synthesis.clip_draft import Playback


def plan(script: Script, frame_limit: int) -> PerformanceReport:
    """Return the report of a performance without its poses. frame_limit: largest number of frames.

    Raises QueryError with a pointer into the script.
    """
    timeline = compose(script)
    played = plan_frames(timeline, script.question.fps, frame_limit)
    joins = _judge_joins(script, timeline, timeline.performed)
    return _report(script, timeline, joins, played, None)


def perform(script: Script, frame_limit: int) -> PerformanceAnswer:
    """Return the performance of a script as one clip. frame_limit: largest number of frames.

    Raises QueryError with a pointer into the script.
    """
    timeline = compose(script)
    question, character = script.question, script.character
    played = plan_frames(timeline, question.fps, frame_limit)
    times = played.times(played.duration)
    feet: FeetResult | None = None
    feet_plan: FeetPlan | None = None
    motion = timeline.performed
    if question.feet == "stand" and character.feet:
        feet_plan = plan_feet(script, timeline)
        (feet,) = standing_feet.describe([feet_plan], character.skeleton.names)
        grid = np.arange(len(motion)) / RATE
        rotations, roots = foot_placement.place_feet(
            feet_plan, grid, motion.rotations, motion.roots
        )
        motion = replace(motion, rotations=rotations, roots=roots)
    joins = _judge_joins(script, timeline, motion)
    rotations, roots = _at_times(question.fps, timeline, feet_plan, motion, times)
    joints = joint_roles.rename_joints(character.skeleton, character.roles, question.names)
    clip = assemble(joints, quat.normalize(rotations), roots, character.bones, question.fps)
    bone = question.root == "bone" or (question.root is None and question.names == "ue5")
    indices = {name: joint for joint, name in enumerate(character.skeleton.names)}
    roles = {role: indices[name] for role, name in character.roles.items()}
    clip = replace(clip, root_bone=bone, roles=roles)
    report = _report(script, timeline, joins, played, feet)
    return PerformanceAnswer(clip, report, _held_joints(timeline, clip, times))


def _held_joints(timeline: Timeline, clip: Clip, times: Frames) -> tuple[HeldJoint, ...]:
    """Return the joints with targets and their times in the clip.

    times: of its frames (F,) in the motion, s.
    """
    joints, last = [], float(times[-1])
    for target in timeline.targets:
        begin, end = ((frame - timeline.begin) / RATE for frame in (target.begin, target.end))
        if end >= 0.0 and begin <= last:
            x, y, z = target.position.tolist()
            played = np.arange(len(times)) / clip.rate
            begins, ends = np.interp((begin, end), times, played).tolist()
            joints.append(HeldJoint(clip.skeleton.names[target.joint], begins, ends, (x, y, z)))
    return tuple(joints)


def _judge_joins(script: Script, timeline: Timeline, motion: Passage) -> list[JoinFacts]:
    """Judge the joins as they are sent: with targets met, and feet placed where they stand.

    Each hard one has a warning, and so has each act that is too fast.
    """
    body = script.character.body
    joins = join_quality.judge(body, timeline.joins, motion, timeline.begin)
    for join in joins:
        if join.reasons:
            timeline.warn(f"/segments/{join.segment}", "; ".join(join.reasons))
    # Acts may be faster than captured clips, as extrapolated ones are.
    stops = [*(span.begin for span in timeline.spans[1:]), len(timeline.done)]
    for index, (span, end) in enumerate(zip(timeline.spans, stops, strict=True)):
        if span.kind == "act" and timeline.captured:
            frames = (span.begin - timeline.begin, end - timeline.begin)
            warning = join_quality.judge_act(body, motion, frames, timeline.captured[index])
            if warning:
                timeline.warn(f"/segments/{index}", warning)
    return joins


def plan_document(report: PerformanceReport) -> bytes:
    """Return a plan as JSON."""
    return orjson.dumps({"trust": report.document()})


def compose(script: Script) -> Timeline:
    """Return the motion of all segments, joined one after another, with targets met."""
    character, question = script.character, script.question
    timeline = Timeline(character, _captured_accelerations(script))
    if question.start.poses:
        timeline.begin_with_given(from_poses(question.start.poses, question.fps, character))
    staged: StagedAct | None = None
    for index, segment in enumerate(script.segments):
        cancellation.check()
        following = _stage_ahead(script, index)
        # Last bits of poses depend on the number of threads, and plans of walks follow from poses.
        with errors_under("segments", index), threadpool_limits(1, user_api="blas"):
            if isinstance(segment, Walk):
                staged = walk_steps.add_walk(timeline, script, index, following)
            elif isinstance(segment, Hold):
                holds.add_hold(timeline, script, index)
            else:
                act = staged or acts.stage_at_join(timeline, script, index)
                acts.add_act(timeline, script, act)
                staged = None
            timeline.check_duration()
    if character.body.hinges:
        # Blends go on with the velocities of the motion before, beyond the limits too.
        limits = hinges.from_card(character.body.hinges)
        timeline.motion = replace(timeline.done, rotations=limits.within(timeline.done.rotations))
    if timeline.targets:
        timeline.motion, timeline.misses = limb_targets.meet_targets(
            character.body, timeline.done, timeline.targets
        )
    return timeline


def _captured_accelerations(script: Script) -> tuple[float, ...]:
    """Return `Timeline.captured`, zero for holds."""
    accelerations = []
    for source in script.sources:
        captured = None if source is None else source.model.session.card.captured_acceleration
        if source is not None and captured is None:
            return ()
        accelerations.append(0.0 if captured is None else captured.p99)
    return tuple(accelerations)


def _stage_ahead(script: Script, index: int) -> StagedAct | None:
    """Return the act that a walk without an end of its own leads to; None for other segments.

    Its errors are of the act's segment.
    """
    walk = script.segments[index]
    if not isinstance(walk, Walk) or any(
        end is not None for end in (walk.along, walk.to, walk.seconds)
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


def plan_frames(timeline: Timeline, fps: float, limit: int) -> Playback:
    """Return the playback in which targets and events have frames.

    Raises InvalidField for more frames than `limit`.
    """
    seconds = (len(timeline.performed) - 1) / RATE
    marks = [target.begin for target in timeline.targets]
    marks += [span.event for span in timeline.spans if span.event is not None]
    moments = [(mark - timeline.begin) / RATE for mark in marks]
    played = clip_draft.playback(fps, 0.0, seconds, moments)
    if (count := len(played.times(played.duration))) > limit:
        raise InvalidField(
            "segments", f"{count} frames at {fps:g} a second, expected at most {limit}"
        )
    return played


def plan_feet(script: Script, timeline: Timeline) -> FeetPlan:
    """Return the plan of the feet over a whole performance, in which targets stay met."""
    body, passage, leads = script.character.body, timeline.performed, None
    if timeline.targets:
        frames = range(timeline.begin, timeline.begin + len(passage))
        body, leads = limb_targets.find_leads(body, timeline.targets, frames)
    request = PlanRequest(
        body,
        passage.rotations,
        passage.roots,
        RATE,
        script.contacts,
        passage.contacts,
        walking=timeline.walking,
        led=leads,
    )
    return body_plans.plan_motions([request])[0]


def _at_times(
    fps: float, timeline: Timeline, feet_plan: FeetPlan | None, motion: Passage, times: Frames
) -> tuple[Rotations, RootPath]:
    """Return rotations and roots at the times (F,), s, of the clip, with placed feet.

    motion: at `RATE`, with placed feet. Times between its frames have feet placed anew.
    """
    step = round(RATE / fps)
    if np.abs(times * RATE - step * np.arange(len(times))).max() < clip_draft.ROUNDING:
        rows = slice(0, step * len(times), step)
        return motion.rotations[rows], motion.roots[rows]
    predicted = timeline.performed
    rotations, roots = resample(predicted.rotations, predicted.roots, RATE, times)
    if feet_plan is None:
        return rotations, roots
    return foot_placement.place_feet(feet_plan, times, rotations, roots)


@dataclass(frozen=True)
class PathErrors:
    """Root mean squares of the errors of a walk, each error a mean over one cycle of phase.

    lateral, along: of the root across and along the path, m. heading: of the direction of travel,
    rad. facing: of the root's heading relative to the path about its own mean, rad. speed: m/s.
    cycles: number of whole cycles; without one, all errors are zero.
    """

    lateral: float
    along: float
    heading: float
    facing: float
    speed: float
    cycles: float


def path_errors(walk: WalkPlan, roots: RootPath, rotations: Rotations) -> PathErrors:
    """Return the errors of a finished motion of F frames against its plan.

    roots: (F, 3), m, and rotations: (F, J, 4), in the plan's place.
    """
    cycles = float(walk.phases[-1] - walk.phases[0])
    if cycles < 1.0:
        return PathErrors(0.0, 0.0, 0.0, 0.0, 0.0, cycles)
    centres, tangents = walk.path.at(walk.distances)
    floor = floor_plane.project(roots)
    offsets = _means(walk.phases, (floor - centres) * np.exp(-1j * tangents))
    travel, planned_travel = _travel(walk, floor), _travel(walk, centres)
    forward = floor_plane.project(quat.rotate(rotations[:, 0], np.array([0.0, 0.0, 1.0])))
    facing = _means(walk.phases, np.unwrap(np.angle(forward)) - tangents)
    return PathErrors(
        _rms(offsets.imag),
        _rms(offsets.real),
        _rms(np.angle(travel * np.conj(planned_travel))),
        _rms(facing - facing.mean()),
        _rms(np.abs(travel) - np.abs(planned_travel)),
        cycles,
    )


def _travel(
    walk: WalkPlan, floor: Annotated[FloorVectors, "frames"]
) -> Annotated[FloorVectors, "means"]:
    """Return velocities (M,) from one cycle's beginning to its end, m/s."""
    begins, stops, times = _cycles(walk.phases)
    frames = np.arange(len(floor))
    steps = np.interp(stops, frames, floor) - np.interp(begins, frames, floor)
    return np.asarray(steps / times)


def _means(
    phases: Annotated[Floats, "frames"], values: Annotated[Floats | FloorVectors, "frames"]
) -> Annotated[Any, "means"]:
    """Return the means (M,) of values over one cycle of phase that begins at each frame."""
    begins, stops, _ = _cycles(phases)
    steps = 0.5 * (values[1:] + values[:-1]) * np.diff(phases)
    sums, frames = np.pad(np.cumsum(steps), (1, 0)), np.arange(len(values))
    return np.asarray(np.interp(stops, frames, sums) - np.interp(begins, frames, sums))


def _cycles(
    phases: Annotated[Floats, "frames"],
) -> tuple[Annotated[Floats, "means"], Annotated[Floats, "means"], Annotated[Floats, "means"]]:
    """Return frames (M,) at which cycles begin and end, and their durations, s."""
    begins = np.flatnonzero(phases <= phases[-1] - 1.0)
    stops = np.interp(phases[begins] + 1.0, phases, np.arange(len(phases)))
    return begins.astype(float), stops, (stops - begins) / RATE


def _rms(values: Annotated[Floats, "means"]) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _report(
    script: Script,
    timeline: Timeline,
    joins: Sequence[JoinFacts],
    played: Playback,
    feet: FeetResult | None,
) -> PerformanceReport:
    """Return the report of a performance.

    joins: judged, in order. played: of its frames. feet: None as predicted.
    """
    times = played.times(played.duration)
    motion, stops = timeline.performed, [later.begin for _, later in pairwise(timeline.spans)]
    misses = {
        target.pointer: miss for target, miss in zip(timeline.targets, timeline.misses, strict=True)
    }
    warnings = [
        ScriptWarning(pointer, f"stays {100.0 * miss:.1f} cm from its target: out of reach")
        for pointer, miss in misses.items()
        if miss > VISIBLE
    ]
    return PerformanceReport(
        script.identities,
        script.character.identity,
        round_micrometres(played.duration),
        len(times),
        round_micrometres(float(np.sqrt(np.mean(np.square(motion.sigmas))))),
        all(span.supported for span in timeline.spans),
        tuple(
            _segment(timeline, index, end, misses)
            for index, end in enumerate([*stops, len(timeline.done) - 1])
        ),
        tuple(_join(join, timeline.begin) for join in joins),
        merge_warnings([*timeline.warnings, *warnings]),
        feet,
        stretch=played.stretch(times) or None,
    )


NUMBER = re.compile(r"\d+(?:\.\d+)?")


def merge_warnings(warnings: Iterable[ScriptWarning]) -> tuple[ScriptWarning, ...]:
    """Return warnings of which those that differ in numbers only are one, at the first place.

    Its message names the other places.
    """
    kinds: dict[str, list[ScriptWarning]] = {}
    for warning in warnings:
        kinds.setdefault(NUMBER.sub("", warning.message), []).append(warning)
    return tuple(_merged(*kind) for kind in kinds.values())


def _merged(first: ScriptWarning, *others: ScriptWarning) -> ScriptWarning:
    if not others:
        return first
    places = ", ".join(other.pointer for other in others)
    message = f"{first.message}; as do {len(others)} more: {places}"
    return replace(first, message=message)


def _segment(timeline: Timeline, index: int, end: int, misses: dict[str, float]) -> SegmentReport:
    """Return the report of a segment. misses: distances of targets by their pointers, m."""
    span, shift = timeline.spans[index], timeline.begin
    root = complex(floor_plane.project(timeline.done.roots[span.begin]))
    return SegmentReport(
        span.kind,
        span.model,
        round_micrometres((span.begin - shift) / RATE),
        round_micrometres((end - shift) / RATE),
        (round_micrometres(root.imag), round_micrometres(root.real)),
        round_micrometres(timeline.done.heading(span.begin)),
        round_micrometres(span.sigma),
        {name: round_micrometres(value) for name, value in span.controls.items()},
        None if span.phase is None else round_micrometres(span.phase),
        None if span.event is None else round_micrometres((span.event - shift) / RATE),
        tuple(
            _on_character(target, misses[f"/segments/{index}/targets/{number}"])
            for number, target in enumerate(span.targets)
        ),
        _path(timeline, span),
        span.notes,
    )


def _on_character(target: ConstraintResult, miss: float) -> ConstraintResult:
    """Return the result of a target on the character, which is not that on the model's bones."""
    return replace(target, miss=round_micrometres(miss), reached=miss <= MISS_TOLERANCE)


def _path(timeline: Timeline, span: Span) -> PathReport | None:
    """Return how far a walk is from its path; None for other segments and less than a cycle."""
    if span.plan is None:
        return None
    walked = timeline.done.part(span.first, span.first + len(span.plan))
    if len(walked) < len(span.plan):
        return None
    errors = path_errors(span.plan, walked.roots, walked.rotations)
    if errors.cycles < 1.0:
        return None
    numbers = (errors.lateral, errors.along, errors.heading, errors.speed)
    return PathReport(*map(round_micrometres, numbers))


def _join(join: JoinFacts, shift: int) -> JoinReport:
    return JoinReport(
        join.segment,
        round_micrometres((join.frame - shift) / RATE),
        round_micrometres(join.distance),
        join.blend,
        round_micrometres(join.seconds),
        round_micrometres(join.peak),
        round_micrometres(join.usual),
        bool(join.reasons),
        join.reference,
    )
