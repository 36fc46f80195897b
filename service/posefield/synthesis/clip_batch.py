"""Predictions of several clips in few calls of the graph, each with the bytes that it has alone.

A call takes as long for the operators of its graph as for 40 frames of a clip, so clips share it.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from msgspec import structs

from posefield.common import cancellation
from posefield.common.errors import InvalidField, QueryError
from posefield.common.units import Floats
from posefield.constraints import constrained_motion
from posefield.constraints.constrained_motion import ConstrainedMotion
from posefield.constraints.targets import NO_CONSTRAINTS, ConstraintSet
from posefield.feet.stance_rows import Cycle
from posefield.inference.onnx_runtime import CURVES
from posefield.locomotion import stride
from posefield.locomotion.stride import Strides
from posefield.motion.skeleton import Skeleton
from posefield.question.motion_question import ClipQuestion
from posefield.question.results import PoseAnswer, Trust
from posefield.synthesis import poses, standing_feet
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
        when = poses.sample_times(request.asked, duration(model, request.question), request.most)
        return predicted(model, request, _predict(model, request, when))
    return _constrained(model, request, request.held)


def _constrained(model: Synthesizer, request: ClipRequest, held: ConstrainedMotion) -> ClipDraft:
    asked, question = request.asked, request.question
    if asked.extrapolate == "refuse":
        check_targets(request.goals, held.results)
    when = poses.sample_times(asked, model.check_duration(held.duration), request.most)
    trust = model.constrained_trust(asked, question, held)
    way = constrained_motion.to_strides(held) if request.stands or request.routed else None
    stretch = held.state.duration / held.duration
    whole = (
        WholeMotion(held.duration, stretch, _cycle(model, request, way)) if request.stands else None
    )
    return ClipDraft(request, when, trust, held, whole, way)


def predicted(
    model: Synthesizer, request: ClipRequest, answer: PoseAnswer[np.float64]
) -> ClipDraft:
    """Return the motion whose poses at its frames are predicted by an answer."""
    question, when = request.question, answer.times
    if model.solver.measures:
        measured = model.solver.measured(question, model.solver.solve(question, NO_CONSTRAINTS))
        answer = replace(answer, trust=structs.replace(answer.trust, measured=measured))
    way = _strides(model, question) if request.stands or request.routed else None
    if not request.stands:
        return ClipDraft(request, when, answer.trust, way=way, predicted=answer)
    whole = WholeMotion(answer.trust.duration, cycle=_cycle(model, request, way))
    answer = poses.join(answer, _predict(model, request, whole.times))
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


MAX_FRAMES = 512
"""Frames of one call, those included that pad shorter clips: more exceed the processor's cache."""


@dataclass(frozen=True)
class _PlannedClip:
    """A clip whose frames are known: its place in the batch, and times (F,), s."""

    place: int
    question: ValidatedQuestion
    when: Floats


def draft_predictions(
    model: Synthesizer, requests: Mapping[int, ClipRequest]
) -> dict[int, ClipDraft]:
    """Return the drafts of clips that can share calls of the graph, by their places.

    requests: of clips without constraints. Those that cannot share calls have no draft: fewer than
    two of a level, outside the sampled ranges, clips of one frame, and those with errors.
    """
    found = {}
    for own in _by_level(model, requests):
        for part in _calls(_plan(model, own)):
            cancellation.check()
            for planned, row in zip(part, _run(model, part), strict=True):
                request, row = own[planned.place], _own_frames(model, planned, row)
                answer = pose_answer(model, request, planned.when, row)
                found[planned.place] = predicted(model, request, answer)
    return found


def _by_level(
    model: Synthesizer, requests: Mapping[int, ClipRequest]
) -> Iterator[dict[int, ClipRequest]]:
    """Yield the requests of each level that may share calls, where there are several."""
    # Durations outside the sampled ranges are bounded by further calls.
    inside = {
        place: own
        for place, own in requests.items()
        if model.session.bounds.is_inside(own.question.point)
    }
    for level in sorted({own.question.level for own in inside.values()}):
        own = {place: each for place, each in inside.items() if each.question.level == level}
        if len(own) > 1 and is_exact(model, level):
            yield own


def longest(model: Synthesizer, asked: ClipQuestion) -> float:
    """Return an upper bound of the number of frames of a clip, known before its synthesis.

    NaN where a field of the question is, which the synthesis refuses.
    """
    last = model.durations[1] if asked.end is None else asked.end
    return (last - asked.start) * asked.fps + 1.0


def _plan(model: Synthesizer, requests: Mapping[int, ClipRequest]) -> list[_PlannedClip]:
    """Return the clips with their frames; those with errors are made alone, which tells them."""
    questions = [own.question for own in requests.values()]
    planned = []
    for (place, own), duration in zip(requests.items(), _durations(model, questions), strict=True):
        try:
            when = poses.sample_times(own.asked, model.check_duration(duration), own.most)
        except QueryError:
            continue
        # A matrix product with one row sums in another order.
        if len(when) > 1:
            planned.append(_PlannedClip(place, own.question, when))
    return planned


def _durations(model: Synthesizer, questions: Sequence[ValidatedQuestion]) -> list[float]:
    points = np.concatenate([own.point for own in questions])
    labels = np.concatenate([own.labels for own in questions])
    found: list[float] = model.session.durations(points, labels, questions[0].level).tolist()
    return found


def _calls(planned: Sequence[_PlannedClip]) -> Iterator[list[_PlannedClip]]:
    """Yield the clips of each call, of similar lengths, since shorter ones are padded."""
    part: list[_PlannedClip] = []
    for own in sorted(planned, key=lambda each: len(each.when)):
        if part and (len(part) + 1) * len(own.when) > MAX_FRAMES:
            yield part
            part = []
        part.append(own)
    if part:
        yield part


def _run(model: Synthesizer, part: Sequence[_PlannedClip]) -> list[OutputRow]:
    """Return the graph's outputs for clips in one call, padded to equally many frames."""
    when = np.empty((len(part), max(len(own.when) for own in part)))
    for times, own in zip(when, part, strict=True):
        times[: len(own.when)], times[len(own.when) :] = own.when, own.when[-1]
    names = poses.pose_outputs(model.session.card)
    answers = model.session.run(
        np.concatenate([own.question.point for own in part]),
        when,
        *names,
        labels=np.concatenate([own.question.labels for own in part]),
        level=part[0].question.level,
    )
    return [tuple(answer[row] for answer in answers) for row in range(len(part))]


def _own_frames(model: Synthesizer, own: _PlannedClip, row: OutputRow) -> OutputRow:
    """Return the outputs of a clip without the frames that pad it."""
    names = poses.pose_outputs(model.session.card)
    return tuple(
        array[: len(own.when)] if name in _PER_FRAME else array
        for name, array in zip(names, row, strict=True)
    )


_PER_FRAME = ("rotations", "root_position", CURVES)


def is_exact(model: Synthesizer, level: int) -> bool:
    """Return whether clips that share a call get the bytes that they get alone.

    Measured once per level with a sample of clips, as `poses.is_batch_exact` does for poses.
    """
    known = model.exact_clip_levels
    if level not in known:
        shares = np.linspace(0.0, 1.0, poses.SAMPLE_SIZE)
        sample = [_sample(model, place, share, level) for place, share in enumerate(shares)]
        questions = [own.question for own in sample]
        alone = [_durations(model, [each])[0] for each in questions]
        rows = zip(sample, _run(model, sample), strict=True)
        pairs = [(own, _run(model, [own])[0], row) for own, row in rows]
        known[level] = alone == _durations(model, questions) and all(
            np.array_equal(a, b)
            for own, single, row in pairs
            for a, b in zip(single, _own_frames(model, own, row), strict=True)
        )
    return known[level]


def _sample(model: Synthesizer, place: int, share: float, level: int) -> _PlannedClip:
    """Return a clip of `place` + 2 frames at a share of each control's range."""
    card = model.session.card
    controls = {c.name: c.minimum + share * (c.maximum - c.minimum) for c in card.controls}
    asked = ClipQuestion(controls=controls, extrapolate="ok", level=level)
    when = np.linspace(0.0, card.durations[0], place + 2)
    return _PlannedClip(place, model.question(asked), when)
