"""Questions to a model, checked at the door, and its answers in the project's own types."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from service.motion.answer import ClipAnswer, PoseAnswer, Trust
from service.motion.card import Control
from service.motion.clip import assemble
from service.motion.conventions import Floats
from service.motion.errors import InvalidField, OutsideSamples
from service.synthesis import limits, pace
from service.synthesis.question import ClipQuestion, Policy, Prospect
from service.synthesis.session import Session
from service.synthesis.view import Ladder

RATES = (1.0, 1000.0)
MOST_POSES = 10_000
ANSWERED = ("rotations", "root_position", "bone_offsets", "duration", "sigma")


@dataclass(frozen=True)
class _Question:
    """What has passed the door: controls and performer as they were given, and as the graph takes
    them, point (1, d) and labels (1, p); a warning for each control outside its sampled range."""

    controls: dict[str, float]
    performer: str | None
    level: int
    point: Floats
    labels: Floats
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class Synthesizer:
    """A named model that answers with poses and clips."""

    name: str
    session: Session

    @property
    def identity(self) -> str:
        """name@contenthash: what an answer under this name will always be."""
        return f"{self.name}@{self.session.digest}"

    @cached_property
    def ladder(self) -> Ladder:
        """What each level of detail errs and costs, for a view to choose by.

        An error is that of the worst pose: nobody's exceeds it, as far as was asked. Costs are
        measured when first wanted.
        """
        errors = np.array([level.pose for level in self.session.card.levels])
        return Ladder(errors, np.array(pace.seconds_per_pose(self.session)))

    @property
    def middle(self) -> Floats:
        """Where the root is at rest (3,), m."""
        return self.session.card.skeleton.offsets[0]

    @cached_property
    def radius(self) -> float:
        """Of a sphere about the root that holds the body at rest, m."""
        joints = self.session.card.skeleton
        rest = joints.at_rest(joints.offsets)
        return float(np.linalg.norm(rest - rest[0], axis=-1).max())

    def pose(
        self,
        controls: Mapping[str, float],
        times: Sequence[float],
        extrapolate: Policy,
        performer: str | None = None,
        level: int = 0,
    ) -> PoseAnswer:
        """Poses at times (S,), s from the start of the clip, as a performer of the card moves, or
        somebody who was never seen, at a level of detail.

        Raises InvalidField for a control, time, performer or level that cannot be used,
        OutsideSamples where `extrapolate` is "refuse" and a control lies outside its sampled range.
        """
        question = self._door(controls, extrapolate, performer, level)
        if not 1 <= len(times) <= MOST_POSES:
            raise InvalidField("times", f"{len(times)} times, expected 1 to {MOST_POSES}")
        when = np.array([_number(f"times/{i}", value) for i, value in enumerate(times)])
        duration = self._duration(question)
        for index, value in enumerate(when):
            _within(f"times/{index}", value, 0.0, duration, "s")
        return self._answer(question, when)

    def clip(self, asked: ClipQuestion) -> ClipAnswer:
        """Clip of the question; frame i is the pose at start + i / fps.

        Raises as `pose` does.
        """
        question = self._door(asked.controls, asked.extrapolate, asked.performer, asked.level)
        when = self._frames(asked, self._duration(question))
        answer = self._answer(question, when)
        clip = assemble(
            self.session.card.skeleton,
            answer.rotations,
            answer.root_position,
            answer.bone_offsets,
            asked.fps,
        )
        return ClipAnswer(clip, answer.trust)

    def check(self, asked: ClipQuestion) -> None:
        """Raise what `clip` would, as far as it can be said before anything is synthesised: how
        long the clip takes is not known yet."""
        self._door(asked.controls, asked.extrapolate, asked.performer, asked.level)
        _window(asked, limits.durations(self.session.card)[1])

    def prospect(self, asked: ClipQuestion) -> Prospect:
        """What `clip` would answer with, before it is synthesised.

        Asked of the graph alone, as there: how long a clip takes differs in its last digit where
        many are asked for at once, and a question whose end is the clip's own would then pass here
        and be refused later. Raises as `clip` does.
        """
        question = self._door(asked.controls, asked.extrapolate, asked.performer, asked.level)
        frames = self._frames(asked, self._duration(question))
        return Prospect(len(frames), question.warnings)

    def _door(
        self, controls: Mapping[str, float], extrapolate: Policy, performer: str | None, level: int
    ) -> _Question:
        card = self.session.card
        limits.check_names(card, controls)
        labels, coarsest = _labels(card.performers, performer), len(card.levels) - 1
        if not 0 <= level <= coarsest:
            raise InvalidField("level", f"{level}, expected 0 to {coarsest}")
        point = np.array([[_required(control, controls) for control in card.controls]])
        warnings = tuple(_outside(c, v) for c, v in zip(card.controls, point[0], strict=True))
        said = tuple(filter(None, warnings))
        if said and extrapolate == "refuse":
            raise OutsideSamples("controls", "; ".join(said))
        given = {name: float(value) for name, value in controls.items()}
        return _Question(given, performer, level, point, labels, said)

    def _duration(self, question: _Question) -> float:
        """Seconds that the clip takes; OutsideSamples where extrapolation has lost all sense."""
        duration = float(self._run(question, np.zeros((1, 1)), "duration")[0][0])
        low, high = limits.durations(self.session.card)
        if not low <= duration <= high:
            raise OutsideSamples("controls", limits.senseless(self.session.card, duration))
        return duration

    def _frames(self, asked: ClipQuestion, duration: float) -> Floats:
        """Times (F,) of the frames asked for, s, of a clip that takes `duration`."""
        rate, start, last = _window(asked, duration)
        # A millionth of a frame forgives the rounding of duration * rate.
        frames = math.floor((last - start) * rate + 1e-6) + 1
        if frames > MOST_POSES:
            raise InvalidField("fps", f"{frames} frames, expected at most {MOST_POSES}")
        return np.minimum(start + np.arange(frames) / rate, duration)

    def _answer(self, question: _Question, when: Floats) -> PoseAnswer:
        answers = self._run(question, when[None], *ANSWERED)
        rotations, root, offsets, duration, sigma = (a[0].astype(np.float64) for a in answers)
        trust = Trust(
            self.identity,
            question.controls,
            float(duration),
            float(sigma),
            question.warnings,
            question.performer,
            question.level,
        )
        return PoseAnswer(when, rotations, root, offsets, trust)

    def _run(self, question: _Question, when: Floats, *outputs: str) -> list[Any]:
        labels, level = question.labels, question.level
        return self.session.run(question.point, when, *outputs, labels=labels, level=level)


def _window(asked: ClipQuestion, duration: float) -> tuple[float, float, float]:
    """Frames a second, start and end, s, of a clip that takes `duration` at most."""
    rate = _number("fps", asked.fps)
    _within("fps", rate, *RATES, "frames a second")
    last = duration if asked.end is None else _number("end", asked.end)
    _within("end", last, 0.0, duration, "s")
    start = _number("start", asked.start)
    _within("start", start, 0.0, last, "s")
    return rate, start, last


def _labels(performers: tuple[str, ...], asked: str | None) -> Floats:
    """Labels (1, p) of the performer asked for: all zero for nobody that was seen."""
    if asked is not None and asked not in performers:
        raise InvalidField("performer", f"{asked!r}, expected {limits.known(performers)}")
    return np.array([[float(name == asked) for name in performers]])


def _required(control: Control, controls: Mapping[str, float]) -> float:
    field = f"controls/{control.name}"
    if control.name not in controls:
        raise InvalidField(
            field,
            f"missing; give a number in {control.unit}, "
            f"sampled from {control.minimum:g} to {control.maximum:g}",
        )
    value = _number(field, controls[control.name])
    _within(field, value, *limits.reach(control), control.unit)
    return value


def _number(field: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InvalidField(field, f"{value!r}, expected a number")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise InvalidField(field, f"{number}, expected a finite number")
    return number


def _within(field: str, value: float, low: float, high: float, unit: str) -> None:
    if not low <= value <= high:
        raise InvalidField(field, f"{value:g} {unit}, expected {low:g} to {high:g} {unit}")


def _outside(control: Control, value: float) -> str | None:
    low, high = limits.sampled(control)
    if low <= value <= high:
        return None
    return (
        f"{control.name} = {value:g} {control.unit} lies outside what was sampled, "
        f"{control.minimum:g} to {control.maximum:g} {control.unit}"
    )
