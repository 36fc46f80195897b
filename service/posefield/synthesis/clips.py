"""Synthesis of clips, and their frame count, warnings and misses before synthesis.

A batch of drafts passes the stages validate, correct or predict, stand, and finish; a stage
is entered only by the drafts that need it.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from msgspec import structs

from posefield.common import cancellation
from posefield.common.errors import InvalidField, QueryError
from posefield.constraints import constrained_motion, constraint
from posefield.constraints.constrained_motion import ConstrainedMotion
from posefield.constraints.targets import NO_CONSTRAINTS
from posefield.locomotion import floor_plane, stride
from posefield.locomotion.stride import Strides
from posefield.motion.clip import assemble
from posefield.motion.curves import CurveValues
from posefield.question.motion_question import ClipQuestion
from posefield.question.results import ClipAnswer, PoseAnswer, split_results
from posefield.robots import robot_clip
from posefield.synthesis import clip_draft, poses, robot_feet, standing_feet
from posefield.synthesis.clip_draft import ClipDraft
from posefield.synthesis.poses import MAX_POSES, OutputRow
from posefield.synthesis.synthesizer import Synthesizer, check_targets
from posefield.validation import question_validation
from posefield.validation.question_validation import ValidatedQuestion


def synthesize_clip(
    model: Synthesizer, question: ClipQuestion, frame_limit: int = MAX_POSES
) -> ClipAnswer:
    """Return the clip of a question; frame i is the pose at start + i / fps.

    Targets, events and ends have frames, at most half a step beside (`clip_draft`). The N steps
    of a loop share the duration evenly, but are played at fps. Raises as `poses.synthesize_poses`
    does, and InvalidField for a loop of a model that is not cyclic, for joint names without roles
    and for more frames than the limit.
    """
    (answer,) = synthesize_clips(model, [question], frame_limit)
    if isinstance(answer, QueryError):
        raise answer
    return answer


def synthesize_clips(
    model: Synthesizer, questions: Sequence[ClipQuestion], frame_limit: int = MAX_POSES
) -> list[ClipAnswer | QueryError]:
    """Return the clips of questions, each with the bytes that it has alone.

    Clips share the calls of NumPy, which take most of the time of one clip. A question that cannot
    be answered has the error that `synthesize_clip` raises.
    """
    drafts = [ClipDraft(question, frame_limit) for question in questions]
    valid = _attempt(drafts, lambda draft: draft.validate(model))
    if constrained := [draft for draft in valid if draft.constraints]:
        _correct(model, constrained)
    if predicted := [draft for draft in valid if not draft.constraints]:
        _predict(model, predicted)
    if standing := [draft for draft in valid if draft.stands and not draft.error]:
        standing_feet.stand(model, standing)
    for draft in valid:
        if draft.is_robot and not draft.error:
            robot_feet.keep_to_robot(model, draft)
    return [draft.error or _finished_clip(model, draft) for draft in drafts]


def _attempt(
    drafts: Sequence[ClipDraft], step: Callable[..., None], *columns: Sequence[Any]
) -> list[ClipDraft]:
    """Return the drafts of which a step can be done; the others have its error.

    columns: further arguments of the step, one for each draft.
    """
    done = []
    for draft, *arguments in zip(drafts, *columns, strict=True):
        cancellation.check()
        try:
            step(draft, *arguments)
            done.append(draft)
        except QueryError as error:
            draft.error = error
    return done


def _correct(model: Synthesizer, drafts: Sequence[ClipDraft]) -> None:
    """Set the poses of drafts with constraints."""
    motions = model.solver.solve_all(
        [(draft.validated, draft.constraints or NO_CONSTRAINTS) for draft in drafts]
    )

    def set_motion(draft: ClipDraft, motion: ConstrainedMotion | QueryError) -> None:
        if isinstance(motion, QueryError):
            raise motion
        if draft.question.extrapolate == "refuse" and draft.constraints:
            check_targets(draft.constraints, motion.results)
        draft.motion = motion
        draft.set_times(model, model.check_duration(motion.duration))
        _set_strides(model, draft, motion.duration)

    corrected = _attempt(drafts, set_motion, motions)
    computed = model.solver.poses(
        [
            (
                draft.validated,
                draft.motion,
                np.append(draft.times, draft.plan_times),
                model.constrained_trust(draft.question, draft.validated, draft.motion),
            )
            for draft in corrected
            if draft.motion is not None
        ]
    )
    for draft, answer in zip(corrected, computed, strict=True):
        frames = len(draft.times)
        draft.answer = replace(
            answer,
            times=draft.times,
            rotations=answer.rotations[:frames],
            root_position=answer.root_position[:frames],
            curves=None if answer.curves is None else answer.curves[:frames],
        )
        draft.plan_poses = answer.rotations[frames:], answer.root_position[frames:]


def _predict(model: Synthesizer, drafts: Sequence[ClipDraft]) -> None:
    """Set the poses of drafts without constraints."""

    def set_times(draft: ClipDraft, duration: float) -> None:
        draft.set_times(model, model.check_duration(duration))

    for group in _groups(model, drafts):
        durations = _durations(model, [draft.validated for draft in group])
        timed = _attempt(group, set_times, durations)
        for batch in _batches(timed):
            cancellation.check()
            rows = poses.predict_frames(
                model, [draft.validated for draft in batch], [draft.times for draft in batch]
            )
            for draft, row in zip(batch, rows, strict=True):
                _set_prediction(model, draft, row)


def _set_prediction(model: Synthesizer, draft: ClipDraft, row: OutputRow) -> None:
    question = draft.validated
    rotations, root, offsets, length, sigma, *curves = (output.astype(np.float64) for output in row)
    trust = model.trust(draft.question, question, float(length), float(sigma))
    if model.measures:
        motion = model.solver.solve(question, NO_CONSTRAINTS)
        trust = structs.replace(trust, measured=constraint.measured(model.session.card, motion))
    draft.answer = PoseAnswer(draft.times, rotations, root, offsets, trust, *curves)
    _set_strides(model, draft, trust.duration)
    if draft.stands:
        (plan_row,) = poses.predict_frames(model, [question], [draft.plan_times])
        draft.plan_poses = plan_row[0].astype(np.float64), plan_row[1].astype(np.float64)


def _set_strides(model: Synthesizer, draft: ClipDraft, duration: float) -> None:
    """Set the path of the root where it is changed or feet stand, and the times of their plan."""
    question, card = draft.validated, model.session.card
    if not (draft.stands or draft.question.loop or draft.question.root == "in_place"):
        return
    if draft.motion is not None:
        draft.strides = constrained_motion.to_strides(draft.motion)
    else:
        measure = stride.strides if card.cyclic else stride.straight_strides
        draft.strides = measure(model.session, question.point, question.labels, question.level)
    if draft.stands:
        # A motion that climbs does not repeat.
        cyclic = card.cyclic and draft.question.ground.slope == 0.0
        standing_feet.set_plan(draft, draft.strides, duration, cyclic)


def _finished_clip(model: Synthesizer, draft: ClipDraft) -> ClipAnswer | QueryError:
    question, answer = draft.question, draft.answer
    trust = clip_draft.of_frames(model, draft)
    if draft.strides is not None:
        in_place = question.root == "in_place" and model.session.card.root == "travelling"
        if in_place:
            answer = _without_travel(answer, draft.strides)
        if question.loop:
            answer = _closed_loop(answer, None if in_place else draft.strides)
    turns, path, offsets = answer.rotations, answer.root_position, answer.bone_offsets
    clip = assemble(draft.skeleton, turns, path, offsets, float(question.fps))
    if answer.curves is not None:
        clip = replace(clip, curves=CurveValues(model.session.card.curves, answer.curves))
    clip = replace(clip, root_bone=question.root_bone, roles=model.role_joints)
    robot = model.session.card.robot
    if robot is not None:
        motion = draft.unlimited or robot_clip.of(robot).motion(clip, "")
        trust = clip_draft.with_limits(trust, motion, robot)
        if trust.limits and question.limits == "refuse":
            return InvalidField("limits", f"'refuse', and {trust.limits[0].sentence}")
    return ClipAnswer(clip, trust, robot, question.loop)


def _without_travel(answer: PoseAnswer[np.float64], strides: Strides) -> PoseAnswer[np.float64]:
    """Return the poses in the frame that travels along the way, placed at the start of the clip."""
    relative = stride.relative_poses(
        strides, answer.times / strides.durations, answer.rotations, answer.root_position
    )
    root = floor_plane.at_height(strides.starts + relative.places, relative.heights)
    return replace(answer, rotations=relative.rotations, root_position=root)


def _closed_loop(answer: PoseAnswer[np.float64], strides: Strides | None) -> PoseAnswer[np.float64]:
    """Return the poses with the first one appended, moved by the cycle's travel if any."""
    rotations, root = answer.rotations[:1], answer.root_position[:1]
    if strides is not None:
        rotations = floor_plane.turn_roots(rotations, strides.turns)
        root = root + floor_plane.at_height(
            floor_plane.arc_displacement(strides.travels, strides.turns), np.zeros(1)
        )
    curves = answer.curves
    return replace(
        answer,
        times=np.append(answer.times, answer.trust.duration),
        rotations=np.concatenate([answer.rotations, rotations]),
        root_position=np.concatenate([answer.root_position, root]),
        curves=None if curves is None else np.concatenate([curves, curves[:1]]),
    )


MAX_FRAMES = 512
"""Frames of one call, those included that pad shorter clips: more exceed the processor's cache."""


def _groups(model: Synthesizer, drafts: Sequence[ClipDraft]) -> Iterator[list[ClipDraft]]:
    """Yield the drafts of each level that share calls of the graph, then the others alone.

    A call takes as long for the operators of its graph as for 40 frames of a clip. Durations
    outside the sampled ranges are bounded by further calls.
    """
    alone = list(drafts)
    if len(drafts) > 1:
        inside = [d for d in drafts if model.session.bounds.is_inside(d.validated.point)]
        for level in sorted({draft.validated.level for draft in inside}):
            group = [draft for draft in inside if draft.validated.level == level]
            if len(group) > 1 and is_exact(model, level):
                yield group
                alone = [draft for draft in alone if draft not in group]
    for draft in alone:
        yield [draft]


def _batches(drafts: Sequence[ClipDraft]) -> Iterator[list[ClipDraft]]:
    """Yield the drafts of each call, of similar lengths, since shorter ones are padded."""
    batch: list[ClipDraft] = []
    for draft in sorted(drafts, key=lambda draft: len(draft.times)):
        # A matrix product with one row sums in another order, so a clip of one frame is alone.
        if batch and (len(batch[0].times) == 1 or (len(batch) + 1) * len(draft.times) > MAX_FRAMES):
            yield batch
            batch = []
        batch.append(draft)
    if batch:
        yield batch


def _durations(model: Synthesizer, questions: Sequence[ValidatedQuestion]) -> list[float]:
    points = np.concatenate([question.point for question in questions])
    labels = np.concatenate([question.labels for question in questions])
    (durations,) = model.session.run(
        points, None, "duration", labels=labels, level=questions[0].level
    )
    seconds: list[float] = durations.tolist()
    return seconds


def is_exact(model: Synthesizer, level: int) -> bool:
    """Return whether clips that share a call get the bytes that they get alone.

    Measured once per level with a sample of clips, as `poses.is_batch_exact` does for poses.
    """
    if level not in model.exact_clip_levels:
        card, sample = model.session.card, []
        for share in np.linspace(0.0, 1.0, poses.SAMPLE_SIZE):
            controls = {c.name: c.minimum + share * (c.maximum - c.minimum) for c in card.controls}
            question = ClipQuestion(controls=controls, extrapolate="ok", level=level)
            sample.append(model.question(question))
        times = [np.linspace(0.0, card.durations[0], 2 + row) for row in range(len(sample))]
        alone = [_durations(model, [question])[0] for question in sample]
        rows = poses.predict_frames(model, sample, times)
        model.exact_clip_levels[level] = alone == _durations(model, sample) and all(
            np.array_equal(a, b)
            for question, frames, row in zip(sample, times, rows, strict=True)
            for a, b in zip(poses.predict_frames(model, [question], [frames])[0], row, strict=True)
        )
    return model.exact_clip_levels[level]


@dataclass(frozen=True)
class ClipPreview:
    """Properties of a clip that are known before its synthesis.

    frames: number of frames. warnings: of the controls, as in the answer; deviations of controls
    that the correction constrains are told with the values at which they act. misses_target:
    whether the clip misses a target.
    """

    frames: int
    warnings: tuple[str, ...]
    misses_target: bool = False


def check(model: Synthesizer, question: ClipQuestion) -> None:
    """Raise the errors of `synthesize_clip` that are known before the duration of the clip is."""
    ClipDraft(question, MAX_POSES).validate(model)
    clip_draft.time_window(question, model.durations[1])


def preview_clip(
    model: Synthesizer, question: ClipQuestion, frame_limit: int = MAX_POSES
) -> ClipPreview:
    """Return frame count, warnings and misses of a clip, without synthesising its frames.

    The duration comes from a call with this question alone, as in `synthesize_clip`: in a batch it
    differs in the last digit, and a question that ends with the clip could pass here and be refused
    later. Raises as `synthesize_clip` does.
    """
    draft = ClipDraft(question, frame_limit)
    draft.validate(model)
    validated, constraints, misses_target = draft.validated, draft.constraints, False
    # Constraints can change the duration, as a target speed or a take does.
    strict = question.extrapolate == "refuse" or model.session.card.cyclic
    if constraints and (constraints.targets or constraints.take or strict):
        draft.motion = motion = model.solve_constraints(
            validated, constraints, question.extrapolate
        )
        _, targets = split_results(motion.results, len(constraints.targets))
        misses_target = question.extrapolate != "ok" and not all(
            target.reached for target in targets
        )
        duration = motion.duration
    else:
        (duration,) = _durations(model, [validated])
    draft.set_times(model, model.check_duration(duration))
    warnings = question_validation.merge_warnings(
        validated.warnings, validated.deviations, question.extrapolate
    )
    # A loop ends with its first frame again.
    return ClipPreview(len(draft.times) + question.loop, warnings, misses_target)
