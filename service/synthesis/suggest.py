"""Which clips to capture next: the points at which one more would lower the variance most.

What counts is the mean variance, over all that may be asked, of the plain field by which the
support flag tells gaps (service/motion/support.py). It hangs on the controls alone, so that each
next point is found as if the ones before had been captured already.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from service.motion.answer import Suggestion, Suggestions
from service.motion.card import ModelCard
from service.motion.conventions import Floats, Indices
from service.motion.errors import InvalidField
from service.motion.support import NUGGET, Support, covariances
from service.synthesis import door, limits
from service.synthesis.synthesizer import Synthesizer

COUNT, MOST = 10, 200
DRAWN, GIVEN = 1000, 10_000
"""Candidates that are drawn, and that may be given."""
ASKED = 500
"""Of the candidates, over so many the variance is averaged."""


@dataclass(frozen=True)
class SuggestQuestion:
    """How many points, and of which: candidates by their controls, or for none points all over the
    box that was sampled. performer: whose clips alone count as captured; everybody's for none."""

    count: int = COUNT
    performer: str | None = None
    candidates: Sequence[Mapping[str, float]] = ()

    def __post_init__(self) -> None:
        limits.within("count", self.count, 1, MOST, "points")
        limits.within("candidates", len(self.candidates), 0, GIVEN, "points")


@dataclass(frozen=True)
class Worth:
    """What a point is worth: by which share the mean variance falls, and the variance there."""

    gain: float
    variance: float


def suggest(model: Synthesizer, asked: SuggestQuestion) -> Suggestions:
    """Points to capture, the one that is worth most first, each as if those before it were.

    InvalidField for a performer that there is not, and a candidate that cannot be used.
    """
    card, own = model.session.card, model.door.support
    door.labels(card.performers, asked.performer)
    points = _given(model, asked.candidates) if asked.candidates else _drawn(own)
    captured = _captured(card, asked.performer)
    samples = own.scaled(np.array(card.examples)[captured])
    ranked = rank(own.scaled(points), samples, asked.count)
    found = tuple(_suggestion(card, own, captured, points[at], worth) for at, worth in ranked)
    return Suggestions(model.identity, asked.performer, len(points), found)


def _given(model: Synthesizer, candidates: Sequence[Mapping[str, float]]) -> Floats:
    """Points (C, d) of candidates, in the card's order."""
    card = model.session.card
    rows = []
    for index, controls in enumerate(candidates):
        try:
            limits.check_names(card, controls)
            rows.append([door.required(control, controls) for control in card.controls])
        except InvalidField as fault:
            raise InvalidField(f"candidates/{index}/{fault.field}", fault.message) from fault
    return np.array(rows)


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


def _captured(card: ModelCard, performer: str | None) -> Indices:
    """Which of the captured clips count."""
    if performer is None:
        return np.arange(len(card.examples))
    return np.flatnonzero(np.array(card.moved_by) == card.performers.index(performer))


def _suggestion(
    card: ModelCard, own: Support, captured: Indices, point: Floats, worth: Worth
) -> Suggestion:
    """A point with what is near it, and what that lacks."""
    examples = np.array(card.examples)[captured]
    gaps = 0.5 * np.abs(own.scaled(examples) - own.scaled(point[None]))
    nearest = int(np.argmin(np.sum(np.square(gaps), axis=1)))
    control = int(np.argmax(gaps[nearest]))
    names = [each.name for each in card.controls]
    source = card.sources[captured[nearest]] if card.sources else None
    return Suggestion(
        dict(zip(names, point.tolist(), strict=True)),
        worth.gain,
        worth.variance,
        source,
        names[control],
        float(gaps[nearest, control]),
    )


def rank(candidates: Floats, samples: Floats, count: int) -> list[tuple[int, Worth]]:
    """Candidates (C, d), in half-ranges like the samples (n, d), that are worth most, by index, the
    first first; each as if those before it were captured."""
    known = _Field.of(candidates, samples)
    found: list[tuple[int, Worth]] = []
    for _ in range(min(count, len(candidates))):
        gains = known.gains()
        gains[[at for at, _ in found]] = -1.0
        at = int(np.argmax(gains))
        share = float(gains[at]) / known.mean
        found.append((at, Worth(share, float(known.variances[at]))))
        known.capture(at)
    return found


@dataclass
class _Field:
    """The plain field over candidates (C, d), as far as it is known by what was captured.

    explained (C, k): what each thing known says of each candidate; variances (C,): what is left;
    toward (C, G): covariances with those of the candidates over which the variance is averaged.
    """

    candidates: Floats
    explained: list[Floats]
    variances: Floats
    toward: Floats
    averaged: Indices

    @classmethod
    def of(cls, candidates: Floats, samples: Floats) -> "_Field":
        """Field that samples (n, d) are known of."""
        averaged = np.unique(np.linspace(0, len(candidates) - 1, ASKED).astype(np.int64))
        own = covariances(samples, samples) + NUGGET * np.eye(len(samples))
        root = np.linalg.cholesky(own)
        known = np.linalg.solve(root, covariances(samples, candidates))
        toward = covariances(candidates, candidates[averaged]) - known.T @ known[:, averaged]
        left = 1.0 - np.sum(np.square(known), axis=0)
        return cls(candidates, list(known), left, toward, averaged)

    @property
    def mean(self) -> float:
        """Variance on average."""
        return float(self.variances[self.averaged].mean())

    def gains(self) -> Floats:
        """By how much the mean variance falls where each candidate (C,) is captured."""
        return np.asarray(np.mean(np.square(self.toward), axis=1) / (self.variances + NUGGET))

    def capture(self, at: int) -> None:
        """Know one of the candidates, too."""
        known = np.stack(self.explained)
        own = covariances(self.candidates, self.candidates[[at]])[:, 0] - known.T @ known[:, at]
        said = own / np.sqrt(self.variances[at] + NUGGET)
        self.explained.append(said)
        self.variances = self.variances - np.square(said)
        self.toward = self.toward - said[:, None] * said[self.averaged]
