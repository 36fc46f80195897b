"""Clips before their poses are computed: validated questions, motions, and frames."""

from dataclasses import dataclass, replace

import numpy as np

from posefield.common.errors import InvalidField
from posefield.common.units import Floats
from posefield.constraints import constrained_motion
from posefield.constraints.constrained_motion import ConstrainedMotion
from posefield.constraints.targets import NO_CONSTRAINTS, ConstraintSet
from posefield.feet.stances import Cycle
from posefield.locomotion import stride
from posefield.locomotion.stride import Strides
from posefield.motion.skeleton import Skeleton
from posefield.question.motion_question import ClipQuestion
from posefield.question.results import PoseAnswer, Trust
from posefield.synthesis import frame_times, standing_feet
from posefield.synthesis.poses import OutputRow, pose_outputs
from posefield.synthesis.standing_feet import WholeMotion
from posefield.synthesis.synthesizer import Synthesizer, check_targets
from posefield.validation.question_validation import ValidatedQuestion


@dataclass(frozen=True)
class ClipRequest:
    """A validated question for a clip.

    joints: with the requested names. stands: whether feet are placed. most: largest number of
    frames. held: the motion that meets the goals; None where there are none.
    """

    asked: ClipQuestion
    question: ValidatedQuestion
    joints: Skeleton
    goals: ConstraintSet
    stands: bool
    most: int
    held: ConstrainedMotion | None = None

    @property
    def routed(self) -> bool:
        """Return whether the path of the root is changed."""
        return self.asked.loop or self.asked.root == "in_place"


@dataclass(frozen=True)
class ClipDraft:
    """A motion of which a clip is made.

    when: times of its frames (S,), s. held: predicted or corrected motion, whose poses are computed
    next; None for one whose poses the graph computed. whole: the motion of which feet are placed;
    None for feet as predicted. way: cycle or line of the root; None where it is not needed.
    predicted: poses at `times`, if the graph computed them.
    """

    request: ClipRequest
    when: Floats
    trust: Trust
    held: ConstrainedMotion | None = None
    whole: WholeMotion | None = None
    way: Strides | None = None
    predicted: PoseAnswer[np.float64] | None = None

    @property
    def times(self) -> Floats:
        """Return the times (S + F,), s, of the frames, then those of the plan of the feet."""
        return self.when if self.whole is None else np.append(self.when, self.whole.times)


def validate(model: Synthesizer, most: int, asked: ClipQuestion) -> ClipRequest:
    """Return the validated question for a clip.

    Raises the errors of `clips.synthesize_clip` that are known before the duration of the clip is.
    """
    question = model.question(asked)
    joints = named_skeleton(model, asked)
    goals = model.solver.constraints(question, asked)
    stands = standing_feet.wants_standing_feet(model.session.card, asked)
    return ClipRequest(asked, question, joints, goals, stands, most)


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


def is_predicted(model: Synthesizer, asked: ClipQuestion) -> bool:
    """Return whether a clip is the model's prediction, without constraints or standing feet.

    Raises as `standing_feet.wants_standing_feet` does.
    """
    stands = standing_feet.wants_standing_feet(model.session.card, asked)
    return not (model.solver.measures or asked.has_constraints or stands)


def draft(model: Synthesizer, request: ClipRequest) -> ClipDraft:
    """Return the motion of a question, with the times of its frames."""
    if request.held is None:
        return _unconstrained(model, request)
    return _constrained(model, request, request.held)


def _constrained(model: Synthesizer, request: ClipRequest, held: ConstrainedMotion) -> ClipDraft:
    """Return the motion that meets constraints."""
    asked, question = request.asked, request.question
    if asked.extrapolate == "refuse":
        check_targets(request.goals, held.results)
    when = frame_times.sample_times(asked, model.check_duration(held.duration), request.most)
    trust = model.constrained_trust(asked, question, held)
    way = constrained_motion.to_strides(held) if request.stands or request.routed else None
    stretch = held.state.duration / held.duration
    whole = (
        WholeMotion(held.duration, stretch, _cycle(model, request, way)) if request.stands else None
    )
    return ClipDraft(request, when, trust, held, whole, way)


def _unconstrained(model: Synthesizer, request: ClipRequest) -> ClipDraft:
    """Return the predicted motion, with the poses that the graph computes."""
    length = duration(model, request.question)
    when = frame_times.sample_times(request.asked, length, request.most)
    return predicted(model, request, _predict(model, request, when))


def predicted(
    model: Synthesizer, request: ClipRequest, answer: PoseAnswer[np.float64]
) -> ClipDraft:
    """Return the motion whose poses at its frames are predicted by an answer."""
    question, when = request.question, answer.times
    if model.solver.measures:
        measured = model.solver.measured(question, model.solver.solve(question, NO_CONSTRAINTS))
        answer = replace(answer, trust=replace(answer.trust, measured=measured))
    way = _strides(model, question) if request.stands or request.routed else None
    if not request.stands:
        return ClipDraft(request, when, answer.trust, way=way, predicted=answer)
    whole = WholeMotion(answer.trust.duration, cycle=_cycle(model, request, way))
    answer = frame_times.join(answer, _predict(model, request, whole.times))
    return ClipDraft(request, when, answer.trust, whole=whole, way=way, predicted=answer)


def duration(model: Synthesizer, question: ValidatedQuestion) -> float:
    """Return the duration of the clip, s; OutsideSamples if extrapolation makes it implausible."""
    durations = model.session.durations(question.point, question.labels, question.level)
    return model.check_duration(float(durations[0]))


def _strides(model: Synthesizer, question: ValidatedQuestion) -> Strides:
    """Return the cycle of a motion, or its straight line from first to last pose."""
    measure = stride.strides if model.session.card.cyclic else stride.straight_strides
    return measure(model.session, question.point, question.labels, question.level)


def _cycle(model: Synthesizer, request: ClipRequest, way: Strides | None) -> Cycle | None:
    """Return the cycle of the feet; a motion that climbs does not repeat."""
    repeats = model.session.card.cyclic and request.asked.ground.is_level
    return standing_feet.cycle_of(way) if way and repeats else None


def _predict(model: Synthesizer, request: ClipRequest, when: Floats) -> PoseAnswer[np.float64]:
    """Return the poses that the graph computes at times (S,), s."""
    question = request.question
    answers = model.session.run(
        question.point,
        when[None],
        *pose_outputs(model.session.card),
        labels=question.labels,
        level=question.level,
    )
    return pose_answer(model, request, when, tuple(answer[0] for answer in answers))


def pose_answer(
    model: Synthesizer, request: ClipRequest, when: Floats, row: OutputRow
) -> PoseAnswer[np.float64]:
    """Return the prediction at times (S,), s, of one row of the graph's outputs."""
    rotations, root, offsets, length, sigma, *curves = (a.astype(np.float64) for a in row)
    trust = model.trust(request.asked, request.question, float(length), float(sigma))
    return PoseAnswer(when, rotations, root, offsets, trust, *curves)
