"""Poses of a model: one question at a time, or as many together as give the same bytes."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from service.motion.answer import PoseAnswer
from service.motion.conventions import Floats, Singles
from service.motion.errors import InvalidField
from service.synthesis import course, limits
from service.synthesis.door import Question
from service.synthesis.exact.goals import Goals
from service.synthesis.question import PoseQuestion
from service.synthesis.synthesizer import Synthesizer

ANSWERED = ("rotations", "root_position", "bone_offsets", "duration", "sigma")
"""What the graph is asked for."""

Row = tuple[Singles, ...]
"""ANSWERED of one question: (S, J, 4), (S, 3), (J, 3), and two numbers."""

SAMPLE = 17
"""Questions that show whether answers depend on others: odd, and more than rows of a kernel."""


@dataclass(frozen=True)
class Moments:
    """A question for poses, and what has passed the door of it, its times (S,), s, as they were
    given and as the graph is asked, and the earliest and the latest of them."""

    given: PoseQuestion
    question: Question
    when: Floats
    asked: Floats
    first: float
    last: float

    @property
    def level(self) -> int:
        """Level of detail."""
        return self.question.level


def pose(model: Synthesizer, asked: PoseQuestion) -> PoseAnswer[Any]:
    """Poses (S,) of the question, as a performer of the card moves, or somebody who was never seen,
    at a level of detail, of a motion that is held to something.

    Raises InvalidField for a control, time, performer or level that cannot be used, for what the
    motion cannot be held to, and for sigma by joint of a model that cannot say; where `extrapolate`
    is "refuse", OutsideSamples where nothing like the controls was captured and OutOfReach for a
    goal that is missed.
    """
    checked = moments(model, asked)
    goals = model.keeper.goals(checked.question, asked.hold)
    if goals:
        return held(model, checked, goals)
    return posed(model, checked, rows(model, [checked])[0])


def moments(model: Synthesizer, asked: PoseQuestion) -> Moments:
    """The question of `pose` as far as it can be checked before the model is asked."""
    question, times = model.question(asked), asked.times
    if not 1 <= len(times) <= course.MOST_POSES:
        raise InvalidField("times", f"{len(times)} times, expected 1 to {course.MOST_POSES}")
    when = [limits.number(f"times/{i}", value) for i, value in enumerate(times)]
    # Whether a time is within the clip shows when the graph has said how long that is; what is
    # within none of them might be more than a float32 holds.
    longest = model.durations[1]
    first, last, given = min(when), max(when), np.array(when)
    fits = 0.0 <= first and last <= longest
    within = given if fits else np.clip(given, 0.0, longest)
    return Moments(asked, question, given, within, first, last)


def held(model: Synthesizer, asked: Moments, goals: Goals) -> PoseAnswer[np.float64]:
    """Poses of a motion that is held to something; raises as `pose`."""
    question, given = asked.question, asked.given
    found = model.meeting(question, goals, given.extrapolate)
    _check_times(asked, model.sensible(found.duration))
    trust = model.held_trust(given, question, found)
    return model.keeper.poses(question, found, asked.when, trust)


def rows(model: Synthesizer, asked: Sequence[Moments]) -> list[Row]:
    """What the graph says to questions of as many times and of one level, in one call.

    Where `exact`, a question gets the same bytes whatever it is asked with.
    """
    first = asked[0].question
    if len(asked) == 1 and len(asked[0].when) == 1:
        # A product with one row is summed in another order: nobody is asked for alone.
        arrays = (first.point, first.labels, asked[0].asked[None])
        points, labels, when = (array.repeat(2, axis=0) for array in arrays)
    else:
        points = np.concatenate([each.question.point for each in asked])
        labels = np.concatenate([each.question.labels for each in asked])
        when = np.array([each.asked for each in asked])
    answers = model.session.run(points, when, *ANSWERED, labels=labels, level=first.level)
    return [tuple(answer[row] for answer in answers) for row in range(len(asked))]


def posed(model: Synthesizer, asked: Moments, row: Row) -> PoseAnswer[np.float32]:
    """The answer that one of `rows` is; raises as `pose` for a time outside the clip."""
    rotations, root, offsets, length, sigma = row
    duration = model.sensible(float(length))
    _check_times(asked, duration)
    trust = model.trust(asked.given, asked.question, duration, float(sigma))
    return PoseAnswer(asked.when, rotations, root, offsets, trust)


def exact(model: Synthesizer, level: int) -> bool:
    """Whether `rows` gives each of many questions the bytes that it gets alone, as a sample of
    questions says; files of old versions sum by where a question stands among others."""
    known = model.exact_levels
    if level not in known:
        asked = [_sample(model, share, level) for share in np.linspace(0.0, 1.0, SAMPLE)]
        alone = (rows(model, [each])[0] for each in asked)
        both = zip(rows(model, asked), alone, strict=True)
        known[level] = all(
            np.array_equal(a, b) for row, own in both for a, b in zip(row, own, strict=True)
        )
    return known[level]


def _sample(model: Synthesizer, share: float, level: int) -> Moments:
    """A question at a share of each control's range, and of the shortest clip."""
    card = model.session.card
    controls = {c.name: c.minimum + share * (c.maximum - c.minimum) for c in card.controls}
    return moments(model, PoseQuestion(controls, [share * card.durations[0]], "ok", level=level))


def _check_times(asked: Moments, duration: float) -> None:
    if not (asked.first >= 0.0 and asked.last <= duration):
        for index, value in enumerate(asked.when):
            limits.within(f"times/{index}", value, 0.0, duration, "s")
