"""Ranking of clips to capture next: candidates across the sampled ranges, or given ones."""

from collections.abc import Mapping, Sequence

import numpy as np

from posefield.common.cancellation import ProgressCallback, ignore_progress
from posefield.common.errors import InvalidField
from posefield.common.units import Floats, Indices
from posefield.kriging import acquisition, kriging_model
from posefield.kriging.acquisition import VarianceReduction
from posefield.kriging.support import Support
from posefield.model_file.model_card import Control, ModelCard
from posefield.question.model_question import SuggestQuestion
from posefield.question.results import Suggestion, Suggestions
from posefield.question.value_validation import check_range
from posefield.synthesis.synthesizer import Synthesizer
from posefield.validation import question_validation

DRAWN_CANDIDATES, MAX_CANDIDATES = 1000, 10_000
"""Number of drawn candidates, and the largest number of given ones."""


def suggest(
    model: Synthesizer,
    asked: SuggestQuestion,
    candidates: Sequence[Mapping[str, float]] | None = None,
    progress: ProgressCallback = ignore_progress,
) -> Suggestions:
    """Return points to capture in order of their expected variance reduction.

    candidates: the points, by their controls; None for points across the sampled ranges. Each rank
    assumes that the points before it were captured. Raises InvalidField for an unknown label and
    for an unusable candidate.
    """
    card, own = model.session.card, model.validator.support
    weights = question_validation.label_weights(card, asked.performer, asked.labels)[0]
    points = _drawn_points(own) if candidates is None else _given_points(model, candidates)
    captured = _captured_indices(card, weights)
    scaled, known = own.scaled(points), own.samples[captured]
    ranked = acquisition.rank_candidates(scaled, known, asked.count, progress)
    found = tuple(_suggestion(card, own, captured, points[at], each) for at, each in ranked)
    return Suggestions(model.identity, asked.performer, len(points), found, asked.labels)


def _captured_indices(card: ModelCard, weights: Floats) -> Indices:
    """Return the indices of the captured clips of the names with weights (p,) above zero.

    A label set without such a name admits all clips. Raises InvalidField if no clip is left.
    """
    kept = np.ones(len(card.examples), dtype=bool)
    for columns in kriging_model.label_columns(0, card.label_counts):
        if weights[columns].any():
            kept &= card.clip_labels[:, columns] @ weights[columns] > 0.0
    if not kept.any():
        raise InvalidField("labels", "no captured clip has these names together")
    return np.flatnonzero(kept)


def _given_points(model: Synthesizer, candidates: Sequence[Mapping[str, float]]) -> Floats:
    """Return the points (C, d) of candidates, in the card's order."""
    check_range("candidates", len(candidates), 1, MAX_CANDIDATES, "points")
    card = model.session.card
    rows = []
    for index, controls in enumerate(candidates):
        try:
            question_validation.check_names(card, controls)
            rows.append([_value(control, controls) for control in card.controls])
        except InvalidField as fault:
            raise InvalidField(f"candidates/{index}/{fault.field}", fault.message) from fault
    return np.array(rows)


def _value(control: Control, controls: Mapping[str, float]) -> float:
    """Return the value of a candidate's control; InvalidField if it is missing or unusable."""
    if control.name not in controls:
        raise InvalidField(f"controls/{control.name}", f"missing; give a number in {control.unit}")
    return question_validation.check_control(control, controls[control.name])


def _drawn_points(own: Support) -> Floats:
    """Return points (DRAWN, d) across the sampled ranges by Roberts' additive recurrence."""
    d = len(own.low)
    ratio = 2.0
    for _ in range(64):
        # The root of x^(d + 1) = x + 1; for one control, the golden ratio.
        ratio = (1.0 + ratio) ** (1.0 / (d + 1))
    steps = ratio ** -np.arange(1.0, d + 1.0)
    share = np.mod(0.5 + np.arange(1, DRAWN_CANDIDATES + 1)[:, None] * steps, 1.0)
    return own.low + share * (own.high - own.low)


def _suggestion(
    card: ModelCard, own: Support, captured: Indices, point: Floats, found: VarianceReduction
) -> Suggestion:
    """Return a point with its nearest captured clip and the control in which that differs most."""
    gaps = 0.5 * np.abs(own.samples[captured] - own.scaled(point[None]))
    nearest = int(np.argmin(np.sum(np.square(gaps), axis=1)))
    control = int(np.argmax(gaps[nearest]))
    names = [each.name for each in card.controls]
    return Suggestion(
        dict(zip(names, point.tolist(), strict=True)),
        found.gain,
        found.variance,
        card.sources[captured[nearest]],
        names[control],
        float(gaps[nearest, control]),
    )
