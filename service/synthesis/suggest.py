"""Which clips to capture next: points all over what was sampled, or such as are given, ranked."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from service.motion.answer import Suggestion, Suggestions
from service.motion.card import Control, ModelCard
from service.motion.conventions import Floats
from service.motion.errors import InvalidField
from service.motion.field import Hyper
from service.motion.support import Support
from service.motion.worth import Worth, rank
from service.synthesis import door, limits
from service.synthesis.synthesizer import Synthesizer

COUNT, MOST = 10, 200
DRAWN, GIVEN = 1000, 10_000
"""Candidates that are drawn, and that may be given."""
# The field of cards that do not say theirs: 5 % of the covariance is left at one over the scale.
PLAIN_SCALE = 0.4
PLAIN = Hyper("gaussian", (0,), np.zeros(0), 0.05)


@dataclass(frozen=True)
class SuggestQuestion:
    """How many points, and of which: candidates by their controls, or for none points all over the
    box that was sampled. performer: who is to be captured; for none, clips of all count alike."""

    count: int = COUNT
    performer: str | None = None
    candidates: Sequence[Mapping[str, float]] = ()

    def __post_init__(self) -> None:
        limits.within("count", self.count, 1, MOST, "points")
        limits.within("candidates", len(self.candidates), 0, GIVEN, "points")


def suggest(model: Synthesizer, asked: SuggestQuestion) -> Suggestions:
    """Points to capture, the one that is worth most first, each as if those before it were.

    The field is that of the poses, with what training found of it. InvalidField for a performer
    that there is not, and a candidate that cannot be used.
    """
    card, own = model.session.card, model.door.support
    labels = door.labels(card.performers, asked.performer)
    points = _given(model, asked.candidates) if asked.candidates else _drawn(own)
    hyper, samples = _field(card, own, asked.performer)
    whose = np.repeat(labels, len(points), axis=0)[:, : samples.shape[1] - points.shape[1]]
    ranked = rank(hyper, np.hstack([own.scaled(points), whose]), samples, asked.count)
    found = tuple(_suggestion(card, own, points[at], worth) for at, worth in ranked)
    return Suggestions(model.identity, asked.performer, len(points), found)


def _field(card: ModelCard, own: Support, performer: str | None) -> tuple[Hyper, Floats]:
    """The field of the poses, or where the card does not say it a plain one, and its samples.

    Performers are told apart where one is asked for.
    """
    samples = own.scaled(np.array(card.examples))
    if card.kriging is None:
        return replace(PLAIN, scales=np.full(len(card.controls), PLAIN_SCALE)), samples
    if performer is None:
        return replace(card.kriging, label=0.0), samples
    return card.kriging, np.hstack([samples, np.eye(len(card.performers))[list(card.moved_by)]])


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


def _suggestion(card: ModelCard, own: Support, point: Floats, worth: Worth) -> Suggestion:
    """A point with what is near it, and what that lacks."""
    gaps = 0.5 * np.abs(own.samples - own.scaled(point[None]))
    nearest = int(np.argmin(np.sum(np.square(gaps), axis=1)))
    control = int(np.argmax(gaps[nearest]))
    names = [each.name for each in card.controls]
    source = card.sources[nearest] if card.sources else None
    return Suggestion(
        dict(zip(names, point.tolist(), strict=True)),
        worth.gain,
        worth.variance,
        source,
        names[control],
        float(gaps[nearest, control]),
    )
