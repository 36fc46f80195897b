"""Clips of a model, and what is known of one before it is synthesised."""

from dataclasses import replace

import numpy as np

from service.motion.answer import ClipAnswer, PoseAnswer
from service.motion.clip import assemble
from service.motion.conventions import Floats
from service.motion.errors import InvalidField
from service.motion.skeleton import Skeleton
from service.synthesis import course
from service.synthesis.door import Question
from service.synthesis.exact import strides
from service.synthesis.exact.goals import NOTHING, Goals
from service.synthesis.poses import ANSWERED
from service.synthesis.question import ClipQuestion, Prospect
from service.synthesis.synthesizer import Synthesizer
from service.synthesis.walk import stride
from service.synthesis.walk.stride import Strides


def clip(model: Synthesizer, asked: ClipQuestion, most: int = course.MOST_POSES) -> ClipAnswer:
    """Clip of the question, of at most so many frames; frame i is the pose at start + i / fps.

    The N steps of a loop share the duration evenly, but are played at fps. Raises as `poses.pose`
    does, and InvalidField for a loop of what is no cycle and names that no role leads to.
    """
    question = model.question(asked)
    joints = _joints(model, asked)
    goals = model.keeper.goals(question, asked.hold)
    if goals:
        answer = _held(model, question, goals, asked, most)
    else:
        answer = _plain(model, question, asked, most)
    turns, path, offsets = answer.rotations, answer.root_position, answer.bone_offsets
    return ClipAnswer(assemble(joints, turns, path, offsets, float(asked.fps)), answer.trust)


def check(model: Synthesizer, asked: ClipQuestion) -> None:
    """Raise what `clip` would, as far as it can be said before anything is synthesised: how long
    the clip takes is not known yet."""
    model.keeper.goals(model.question(asked), asked.hold)
    _joints(model, asked)
    course.window(asked, model.durations[1])


def prospect(model: Synthesizer, asked: ClipQuestion) -> Prospect:
    """What `clip` would answer with, before it is synthesised.

    Asked for one by one, as there: how long clips take differs in the last digit where many are
    asked for at once, and a question whose end is the clip's own would pass here and be refused
    later. Raises as `clip` does.
    """
    question = model.question(asked)
    _joints(model, asked)
    duration, misses = _outlook(model, question, asked)
    times = course.times(asked, duration)
    # A loop ends with its first frame again.
    return Prospect(len(times) + asked.loop, question.warnings, misses)


def _joints(model: Synthesizer, asked: ClipQuestion) -> Skeleton:
    """The skeleton with the names asked for; InvalidField for names that no role leads to, for a
    loop of what is no cycle, and for sigma by joint of a model that cannot say."""
    if asked.joint_sigma:
        model.shares()
    if asked.loop and not model.session.card.cyclic:
        raise InvalidField(
            "loop", "true, expected false: this model's last pose does not lead into its first"
        )
    return model.skeleton(asked.names)


def _plain(
    model: Synthesizer, question: Question, asked: ClipQuestion, most: int
) -> PoseAnswer[np.float64]:
    """Frames of a clip that is held to nothing."""
    when = course.times(asked, _duration(model, question), most)
    answer = _answer(model, question, asked, when)
    if model.keeper.measures:
        predicted = model.keeper.held(question, NOTHING)
        measured = model.keeper.measured(question, predicted)
        answer = replace(answer, trust=replace(answer.trust, measured=measured))
    if asked.loop or asked.root == "in_place":
        card = model.session.card
        measure = stride.strides if card.cyclic else stride.straight
        way = measure(model.session, question.point, question.labels, question.level)
        answer = _routed(model, answer, way, asked)
    return answer


def _held(
    model: Synthesizer, question: Question, goals: Goals, asked: ClipQuestion, most: int
) -> PoseAnswer[np.float64]:
    """Frames of a clip that is held to something."""
    held = model.meeting(question, goals, asked.extrapolate)
    when = course.times(asked, model.sensible(held.duration), most)
    trust = model.held_trust(asked, question, held)
    answer = model.keeper.poses(question, held, when, trust)
    routed = asked.loop or asked.root == "in_place"
    return _routed(model, answer, strides.of(held), asked) if routed else answer


def _outlook(model: Synthesizer, question: Question, asked: ClipQuestion) -> tuple[float, bool]:
    """Seconds that a clip takes, which a speed that it is held to changes, and whether it misses
    some target."""
    goals = model.keeper.goals(question, asked.hold)
    strict = asked.extrapolate == "refuse" or model.session.card.cyclic
    if not (goals.targets or (goals and strict)):
        return _duration(model, question), False
    held = model.meeting(question, goals, asked.extrapolate)
    targets = held.met[len(held.met) - len(goals.targets) :]
    misses = asked.extrapolate != "ok" and not all(met.reached for met in targets)
    return model.sensible(held.duration), misses


def _duration(model: Synthesizer, question: Question) -> float:
    """Seconds that the clip takes; OutsideSamples where extrapolation has lost all sense."""
    durations = model.session.durations(question.point, question.labels, question.level)
    return model.sensible(float(durations[0]))


def _routed(
    model: Synthesizer, answer: PoseAnswer[np.float64], way: Strides, asked: ClipQuestion
) -> PoseAnswer[np.float64]:
    """The answer in place, or closed, as asked for."""
    stays = asked.root == "in_place" and model.session.card.root == "travelling"
    answer = course.in_place(answer, way) if stays else answer
    return course.closed(answer, None if stays else way) if asked.loop else answer


def _answer(
    model: Synthesizer, question: Question, asked: ClipQuestion, when: Floats
) -> PoseAnswer[np.float64]:
    labels, level = question.labels, question.level
    answers = model.session.run(question.point, when[None], *ANSWERED, labels=labels, level=level)
    rotations, root, offsets, duration, sigma = (a[0].astype(np.float64) for a in answers)
    trust = model.trust(asked, question, float(duration), float(sigma))
    return PoseAnswer(when, rotations, root, offsets, trust)
