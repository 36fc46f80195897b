"""Which clips to capture next: points all over what was sampled, or such as are given, ranked."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from service.motion import worth
from service.motion.answer import Suggestion, Suggestions
from service.motion.card import Control, ModelCard
from service.motion.conventions import Floats, Indices
from service.motion.errors import InvalidField
from service.motion.support import Support
from service.motion.worth import Worth
from service.synthesis import door, limits
from service.synthesis.synthesizer import Synthesizer

COUNT, MOST = 10, 200
DRAWN, GIVEN = 1000, 10_000
"""Candidates that are drawn, and that may be given."""


@dataclass(frozen=True)
class SuggestQuestion:
    """How many points, and of which: candidates by their controls, or for none points all over the
    box that was sampled. performer: whose clips alone count as captured; all do for none."""

    count: int = COUNT
    performer: str | None = None
    candidates: Sequence[Mapping[str, float]] | None = None

    def __post_init__(self) -> None:
        limits.within("count", self.count, 1, MOST, "points")
        if self.candidates is not None:
            limits.within("candidates", len(self.candidates), 1, GIVEN, "points")


def suggest(model: Synthesizer, asked: SuggestQuestion) -> Suggestions:
    """Points to capture, the one that is worth most first, each as if those before it were.

    InvalidField for a performer that there is not, and a candidate that cannot be used.
    """
    card, own = model.session.card, model.door.support
    door.labels(card.performers, asked.performer)
    points = _drawn(own) if asked.candidates is None else _given(model, asked.candidates)
    captured = _captured(card, asked.performer)
    ranked = worth.rank(own.scaled(points), own.samples[captured], asked.count)
    found = tuple(_suggestion(card, own, captured, points[at], each) for at, each in ranked)
    return Suggestions(model.identity, asked.performer, len(points), found)


def _captured(card: ModelCard, performer: str | None) -> Indices:
    """Which of the captured clips count."""
    if performer is None:
        return np.arange(len(card.examples))
    return np.flatnonzero(np.array(card.moved_by) == card.performers.index(performer))


def _given(model: Synthesizer, candidates: Sequence[Mapping[str, float]]) -> Floats:
    """Points (C, d) of candidates, in the card's order."""
    card = model.session.card
    rows = []
    for index, controls in enumerate(candidates):
        try:
            limits.check_names(card, controls)
            rows.append([_value(control, controls) for control in card.controls])
        except InvalidField as fault:
            raise InvalidField(f"candidates/{index}/{fault.field}", fault.message) from fault
    return np.array(rows)


def _value(control: Control, controls: Mapping[str, float]) -> float:
    """Value of a control of a candidate, which has all of them."""
    if control.name not in controls:
        raise InvalidField(f"controls/{control.name}", f"missing; give a number in {control.unit}")
    return door.checked(control, controls[control.name])


def _drawn(own: Support) -> Floats:
    """Points (DRAWN, d) all over the box that was sampled: the additive recurrence of Roberts."""
    d = len(own.low)
    ratio = 2.0
    for _ in range(64):
        # The root of x^(d + 1) = x + 1: the golden ratio, for one control.
        ratio = (1.0 + ratio) ** (1.0 / (d + 1))
    steps = ratio ** -np.arange(1.0, d + 1.0)
    share = np.mod(0.5 + np.arange(1, DRAWN + 1)[:, None] * steps, 1.0)
    return own.low + share * (own.high - own.low)


def _suggestion(
    card: ModelCard, own: Support, captured: Indices, point: Floats, found: Worth
) -> Suggestion:
    """A point with what is near it, and what that lacks."""
    gaps = 0.5 * np.abs(own.samples[captured] - own.scaled(point[None]))
    nearest = int(np.argmin(np.sum(np.square(gaps), axis=1)))
    control = int(np.argmax(gaps[nearest]))
    names = [each.name for each in card.controls]
    return Suggestion(
        dict(zip(names, point.tolist(), strict=True)),
        found.gain,
        found.variance,
        card.sources[captured[nearest]] if card.sources else None,
        names[control],
        float(gaps[nearest, control]),
    )
