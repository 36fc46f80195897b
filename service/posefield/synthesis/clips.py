"""Synthesis of clips, and their frame count, warnings and solver cost before synthesis."""

from dataclasses import dataclass, replace

import numpy as np

from posefield.common.errors import InvalidField
from posefield.common.units import Floats
from posefield.constraints import constrained_motion
from posefield.constraints.targets import NO_CONSTRAINTS, ConstraintSet
from posefield.feet.stances import Cycle
from posefield.locomotion import stride
from posefield.locomotion.stride import Strides
from posefield.motion.clip import assemble
from posefield.motion.curves import CurveValues
from posefield.motion.skeleton import Skeleton
from posefield.question.motion_question import ClipQuestion
from posefield.question.results import ClipAnswer, PoseAnswer, split_results
from posefield.synthesis import frame_times, standing_feet
from posefield.synthesis.poses import OutputRow, pose_outputs
from posefield.synthesis.standing_feet import WholeMotion
from posefield.synthesis.synthesizer import Synthesizer
from posefield.validation import question_validation
from posefield.validation.question_validation import ValidatedQuestion


@dataclass(frozen=True)
class ClipPreview:
    """Properties of a clip that are known before its synthesis.

    frames: number of frames. warnings: of the controls, as in the answer; deviations of controls
    that the correction constrains are told with the values at which they act. missed: true if the
    clip misses a target.
    """

    frames: int
    warnings: tuple[str, ...]
    missed: bool = False


def synthesize_clip(
    model: Synthesizer, asked: ClipQuestion, most: int = frame_times.MAX_POSES
) -> ClipAnswer:
    """Return the clip of a question; frame i is the pose at start + i / fps.

    most: largest number of frames. The N steps of a loop share the duration evenly, but are played
    at fps. Raises as `poses.synthesize_poses` does, and InvalidField for a loop of a model that is
    not cyclic, for joint names without roles and for more than `most` frames.
    """
    question = model.question(asked)
    named_skeleton(model, asked)
    goals = model.solver.constraints(question, asked)
    if goals:
        answer = _constrained(model, question, goals, asked, most)
        return _clip_answer(model, asked, answer)
    when = frame_times.sample_times(asked, _duration(model, question), most)
    return predicted_clip(model, question, asked, _predict(model, question, asked, when))


def predicted_clip(
    model: Synthesizer,
    question: ValidatedQuestion,
    asked: ClipQuestion,
    answer: PoseAnswer[np.float64],
) -> ClipAnswer:
    """Return the clip of a question without constraints, of the prediction at its frames."""
    return _clip_answer(model, asked, _unconstrained(model, question, asked, answer))


def _clip_answer(
    model: Synthesizer, asked: ClipQuestion, answer: PoseAnswer[np.float64]
) -> ClipAnswer:
    joints = model.skeleton(asked.names)
    turns, path, offsets = answer.rotations, answer.root_position, answer.bone_offsets
    clip = assemble(joints, turns, path, offsets, float(asked.fps))
    if answer.curves is not None:
        clip = replace(clip, curves=CurveValues(model.session.card.curves, answer.curves))
    return ClipAnswer(clip, answer.trust)


def is_predicted(model: Synthesizer, asked: ClipQuestion) -> bool:
    """Return whether a clip is the model's prediction, without constraints or standing feet.

    Raises as `standing_feet.wants_standing_feet` does.
    """
    stands = standing_feet.wants_standing_feet(model.session.card, asked)
    return not (model.solver.measures or asked.has_constraints or stands)


def check(model: Synthesizer, asked: ClipQuestion) -> None:
    """Raise the errors of `synthesize_clip` that are known before the duration of the clip is."""
    model.solver.constraints(model.question(asked), asked)
    standing_feet.wants_standing_feet(model.session.card, asked)
    named_skeleton(model, asked)
    frame_times.time_window(asked, model.durations[1])


def preview_clip(
    model: Synthesizer, asked: ClipQuestion, most: int = frame_times.MAX_POSES
) -> ClipPreview:
    """Return frame count, warnings and misses of a clip, without synthesising its frames.

    The duration comes from a call with this question alone, as in `synthesize_clip`: in a batch it
    differs in the last digit, and a question that ends with the clip could pass here and be refused
    later. Raises as `synthesize_clip` does.
    """
    question = model.question(asked)
    standing_feet.wants_standing_feet(model.session.card, asked)
    named_skeleton(model, asked)
    duration, misses = _duration_and_misses(model, question, asked)
    times = frame_times.sample_times(asked, duration, most)
    # A loop ends with its first frame again.
    warnings = question_validation.merge_warnings(
        question.warnings, question.deviations, asked.extrapolate
    )
    return ClipPreview(len(times) + asked.loop, warnings, misses)


def named_skeleton(model: Synthesizer, asked: ClipQuestion) -> Skeleton:
    """Return the skeleton with the requested names.

    Raises InvalidField for names of a convention without roles, and for a loop of a model that is
    not cyclic.
    """
    if asked.loop and not model.session.card.cyclic:
        raise InvalidField(
            "loop", "true, expected false: this model's last pose does not lead into its first"
        )
    return model.skeleton(asked.names)


def _unconstrained(
    model: Synthesizer,
    question: ValidatedQuestion,
    asked: ClipQuestion,
    answer: PoseAnswer[np.float64],
) -> PoseAnswer[np.float64]:
    """Return the frames of a clip without constraints, of the prediction at these frames."""
    if model.solver.measures:
        predicted = model.solver.solve(question, NO_CONSTRAINTS)
        measured = model.solver.measured(question, predicted)
        answer = replace(answer, trust=replace(answer.trust, measured=measured))
    stands = standing_feet.wants_standing_feet(model.session.card, asked)
    routed = asked.loop or asked.root == "in_place"
    way = _strides(model, question) if stands or routed else None
    if stands:
        motion = WholeMotion(
            lambda times: _predict(model, question, asked, times),
            answer.trust.duration,
            cycle=_cycle(model, way),
        )
        answer = standing_feet.stand(model, question, NO_CONSTRAINTS, answer, motion, asked.ground)
    return _apply_root_options(model, answer, way, asked) if way and routed else answer


def _strides(model: Synthesizer, question: ValidatedQuestion) -> Strides:
    """Return the cycle of a motion, or its straight line from first to last pose."""
    measure = stride.strides if model.session.card.cyclic else stride.straight_strides
    return measure(model.session, question.point, question.labels, question.level)


def _cycle(model: Synthesizer, way: Strides | None) -> Cycle | None:
    return standing_feet.cycle_of(way) if way and model.session.card.cyclic else None


def _constrained(
    model: Synthesizer,
    question: ValidatedQuestion,
    goals: ConstraintSet,
    asked: ClipQuestion,
    most: int,
) -> PoseAnswer[np.float64]:
    """Return the frames of a clip that meets constraints."""
    held = model.solve_constraints(question, goals, asked.extrapolate)
    when = frame_times.sample_times(asked, model.check_duration(held.duration), most)
    trust = model.constrained_trust(asked, question, held)
    answer = model.solver.poses(question, held, when, trust)
    way = constrained_motion.to_strides(held)
    if standing_feet.wants_standing_feet(model.session.card, asked):
        motion = WholeMotion(
            lambda times: model.solver.poses(question, held, times, trust),
            held.duration,
            held.state.duration / held.duration,
            _cycle(model, way),
        )
        answer = standing_feet.stand(model, question, goals, answer, motion, asked.ground)
    routed = asked.loop or asked.root == "in_place"
    return _apply_root_options(model, answer, way, asked) if routed else answer


def _duration_and_misses(
    model: Synthesizer, question: ValidatedQuestion, asked: ClipQuestion
) -> tuple[float, bool]:
    """Return the duration of a clip, s, and whether it misses a target.

    Constraints can change the duration, as a target speed does.
    """
    goals = model.solver.constraints(question, asked)
    strict = asked.extrapolate == "refuse" or model.session.card.cyclic
    if not (goals.targets or (goals and strict)):
        return _duration(model, question), False
    held = model.solve_constraints(question, goals, asked.extrapolate)
    _, targets = split_results(held.results, len(goals.targets))
    misses = asked.extrapolate != "ok" and not all(met.reached for met in targets)
    return model.check_duration(held.duration), misses


def _duration(model: Synthesizer, question: ValidatedQuestion) -> float:
    """Return the duration of the clip, s; OutsideSamples if extrapolation makes it implausible."""
    durations = model.session.durations(question.point, question.labels, question.level)
    return model.check_duration(float(durations[0]))


def _apply_root_options(
    model: Synthesizer, answer: PoseAnswer[np.float64], way: Strides, asked: ClipQuestion
) -> PoseAnswer[np.float64]:
    """Return the answer in place, or closed to a loop, as the question requests."""
    stays = asked.root == "in_place" and model.session.card.root == "travelling"
    answer = frame_times.remove_travel(answer, way) if stays else answer
    return frame_times.close_loop(answer, None if stays else way) if asked.loop else answer


def _predict(
    model: Synthesizer, question: ValidatedQuestion, asked: ClipQuestion, when: Floats
) -> PoseAnswer[np.float64]:
    labels, level = question.labels, question.level
    answers = model.session.run(
        question.point,
        when[None],
        *pose_outputs(model.session.card),
        labels=labels,
        level=level,
    )
    return pose_answer(model, question, asked, when, tuple(answer[0] for answer in answers))


def pose_answer(
    model: Synthesizer,
    question: ValidatedQuestion,
    asked: ClipQuestion,
    when: Floats,
    row: OutputRow,
) -> PoseAnswer[np.float64]:
    """Return the prediction at times (S,), s, of one row of the graph's outputs."""
    rotations, root, offsets, duration, sigma, *curves = (a.astype(np.float64) for a in row)
    trust = model.trust(asked, question, float(duration), float(sigma))
    return PoseAnswer(when, rotations, root, offsets, trust, *curves)
