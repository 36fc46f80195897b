"""Trust in answers: why one is what it is, sigma over two controls, and clips to capture next.

The poses of the finest level are a weighted sum of the captured clips in the coordinates of the
motion tensor; the weights depend on the controls and the performer, not on the time. Captures are
ranked by the mean kriging variance, over the candidates, of the field that decides support: each
next point is selected as if the points before had been captured already.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from posefield.common import cancellation
from posefield.common.cancellation import ProgressCallback, ignore_progress
from posefield.common.errors import InvalidField, did_you_mean
from posefield.common.units import Booleans, Floats, Indices, SampleControls, Singles
from posefield.kriging import kriging_model, support
from posefield.kriging.support import NUGGET, Support, covariances
from posefield.model_file.model_card import PERFORMER, Control, ModelCard
from posefield.question.model_question import SigmaQuestion, SuggestQuestion, WhyQuestion
from posefield.question.motion_question import check_range
from posefield.question.results import (
    CapturedClip,
    Explanation,
    GridAxis,
    SigmaGrid,
    Suggestion,
    Suggestions,
    SupportReport,
)
from posefield.synthesis.synthesizer import Synthesizer
from posefield.validation import question_validation
from posefield.validation.question_validation import QuestionValidator, ValidatedQuestion

AVERAGED_CANDIDATES = 500
"""Number of candidates over which the variance is averaged."""


@dataclass(frozen=True)
class VarianceReduction:
    """Value of a point: the share by which the mean variance falls, and the variance there."""

    gain: float
    variance: float


def rank_candidates(
    candidates: Annotated[Floats, "candidates controls"],
    samples: SampleControls,
    count: int,
    progress: ProgressCallback = ignore_progress,
) -> list[tuple[int, VarianceReduction]]:
    """Return the candidates (C, d) of the largest gains, by index, in greedy order.

    samples (n, d): captured, in half-ranges like the candidates. Each gain assumes the candidates
    before it as captured.
    """
    field = _ConditionedField.conditioned_on(candidates, samples)
    ranked: list[tuple[int, VarianceReduction]] = []
    steps = min(count, len(candidates))
    for done in range(steps):
        cancellation.check()
        gains = field.gains()
        gains[[at for at, _ in ranked]] = -1.0
        at = int(np.argmax(gains))
        ranked.append((at, VarianceReduction(float(gains[at]), float(field.variances[at]))))
        field.condition_on(at)
        progress(done + 1, steps)
    return ranked


@dataclass
class _ConditionedField:
    """Kriging field over candidates (C, d), conditioned on the captured points.

    whitened: k rows (C,), the whitened covariances of each captured point with the candidates.
    variances (C,): of the candidates. remaining (C, G): covariances with the candidates over which
    the variance is averaged, `averaged`.
    """

    candidates: Annotated[Floats, "candidates controls"]
    whitened: list[Annotated[Floats, "candidates"]]
    variances: Annotated[Floats, "candidates"]
    remaining: Annotated[Floats, "candidates averaged"]
    averaged: Annotated[Indices, "averaged"]

    @classmethod
    def conditioned_on(
        cls, candidates: Annotated[Floats, "candidates controls"], samples: SampleControls
    ) -> "_ConditionedField":
        """Return the field conditioned on samples (n, d)."""
        averaged = np.unique(
            np.linspace(0, len(candidates) - 1, AVERAGED_CANDIDATES).astype(np.int64)
        )
        covariance = covariances(samples, samples) + NUGGET * np.eye(len(samples))
        whitened = np.linalg.solve(np.linalg.cholesky(covariance), covariances(samples, candidates))
        remaining = (
            covariances(candidates, candidates[averaged]) - whitened.T @ whitened[:, averaged]
        )
        left = 1.0 - np.sum(np.square(whitened), axis=0)
        return cls(candidates, list(whitened), left, remaining, averaged)

    def gains(self) -> Annotated[Floats, "candidates"]:
        """Return the share by which the mean variance falls if each candidate (C,) is captured."""
        falls = np.mean(np.square(self.remaining), axis=1) / (self.variances + NUGGET)
        return np.asarray(falls / self.variances[self.averaged].mean())

    def condition_on(self, at: int) -> None:
        """Condition the field on one of the candidates as well."""
        whitened = np.stack(self.whitened)
        covariance = (
            covariances(self.candidates, self.candidates[[at]])[:, 0] - whitened.T @ whitened[:, at]
        )
        row = covariance / np.sqrt(self.variances[at] + NUGGET)
        self.whitened.append(row)
        self.variances = self.variances - np.square(row)
        self.remaining = self.remaining - row[:, None] * row[self.averaged]


DRAWN_CANDIDATES, MAX_CANDIDATES = 1000, 10_000
"""Number of drawn candidates, and the largest number of given ones."""


def suggest(
    model: Synthesizer,
    question: SuggestQuestion,
    candidates: Sequence[Mapping[str, float]] | None = None,
    progress: ProgressCallback = ignore_progress,
) -> Suggestions:
    """Return points to capture in order of their expected variance reduction.

    candidates: the points, by their controls; None for points across the sampled ranges. Each rank
    assumes that the points before it were captured. Raises InvalidField for an unknown label and
    for an unusable candidate.
    """
    card, captured_support = model.session.card, model.validator.support
    weights = question_validation.label_weights(card, question.performer, question.labels)[0]
    points = (
        _drawn_points(captured_support) if candidates is None else _given_points(model, candidates)
    )
    captured = _captured_indices(card, weights)
    scaled, samples = captured_support.scaled(points), captured_support.samples[captured]
    ranked = rank_candidates(scaled, samples, question.count, progress)
    suggestions = tuple(
        _suggestion(card, captured_support, captured, points[at], reduction)
        for at, reduction in ranked
    )
    return Suggestions(
        model.identity, question.performer, len(points), suggestions, question.labels
    )


def _captured_indices(card: ModelCard, weights: Floats) -> Indices:
    """Return the indices of the captured clips of the names with weights (p,) above zero.

    A label set without such a name admits all clips. Raises InvalidField if no clip is left.
    """
    mask = np.ones(len(card.examples), dtype=bool)
    for columns in kriging_model.label_columns(0, card.label_counts):
        if weights[columns].any():
            mask &= card.clip_labels[:, columns] @ weights[columns] > 0.0
    if not mask.any():
        raise InvalidField("labels", "no captured clip has these names together")
    return np.flatnonzero(mask)


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


def _drawn_points(captured_support: Support) -> Floats:
    """Return points (DRAWN, d) across the sampled ranges by Roberts' additive recurrence."""
    d = len(captured_support.low)
    ratio = 2.0
    for _ in range(64):
        # The root of x^(d + 1) = x + 1; for one control, the golden ratio.
        ratio = (1.0 + ratio) ** (1.0 / (d + 1))
    steps = ratio ** -np.arange(1.0, d + 1.0)
    share = np.mod(0.5 + np.arange(1, DRAWN_CANDIDATES + 1)[:, None] * steps, 1.0)
    return captured_support.low + share * (captured_support.high - captured_support.low)


def _suggestion(
    card: ModelCard,
    captured_support: Support,
    captured: Indices,
    point: Floats,
    reduction: VarianceReduction,
) -> Suggestion:
    """Return a point with its nearest captured clip and the control in which that differs most."""
    gaps = 0.5 * np.abs(captured_support.samples[captured] - captured_support.scaled(point[None]))
    nearest = int(np.argmin(np.sum(np.square(gaps), axis=1)))
    control = int(np.argmax(gaps[nearest]))
    names = [axis.name for axis in card.controls]
    return Suggestion(
        dict(zip(names, point.tolist(), strict=True)),
        reduction.gain,
        reduction.variance,
        card.sources[captured[nearest]],
        names[control],
        float(gaps[nearest, control]),
    )


NEAREST, MOST = 10, 10_000


def explain_result(model: Synthesizer, why: WhyQuestion) -> Explanation:
    """Return the nearest captured clips, their weights and the support of an answer.

    Raises InvalidField and OutsideSamples as the validation of questions does.
    """
    card = model.session.card
    question = model.validator.question(why.controls, why.extrapolate, why.performer, 0, why.labels)
    distances = model.session.kriging_weights.distances(_point(card, question))[0]
    limited = model.session.bounds.limit(question.point).astype(np.float64)
    acting = replace(question, point=limited)
    weights = model.session.kriging_weights.weights(_point(card, acting))[0]
    order = np.argsort(distances, kind="stable")
    near, rest_indices = order[: why.nearest], order[why.nearest :]
    # Kriging weights sum to one, so at least one is positive.
    positive = np.maximum(weights, 0.0)
    shares = positive / positive.sum()
    nearest = tuple(
        _captured_clip(card, i, distances[i], weights[i], shares[i]) for i in near.tolist()
    )
    rest = float(weights[rest_indices].sum()), float(shares[rest_indices].sum())
    controls, performer = question.controls, question.performer
    warnings = question_validation.merge_warnings(
        question.warnings, question.deviations, why.extrapolate
    )
    inferred, backing = question.inferred, _support_report(model.validator, question)
    return Explanation(
        model.identity,
        controls,
        performer,
        warnings,
        backing,
        nearest,
        len(rest_indices),
        *rest,
        inferred,
        question.named_labels,
    )


def _support_report(validator: QuestionValidator, question: ValidatedQuestion) -> SupportReport:
    captured_support = validator.support
    beyond = dict(
        zip(question.controls, captured_support.beyond(question.point)[0].tolist(), strict=True)
    )
    variance = float(captured_support.variance(question.point)[0])
    return SupportReport(
        question.supported, beyond, support.RANGE_MARGIN, variance, captured_support.limit
    )


def _point(card: ModelCard, question: ValidatedQuestion) -> Floats:
    """Return the point (1, d + p) of the kriging model."""
    point = support.half_ranges(question.point, *card.sampled_ranges)
    return np.hstack([point, question.labels])


def _captured_clip(
    card: ModelCard, index: int, distance: float, weight: float, share: float
) -> CapturedClip:
    names = (control.name for control in card.controls)
    controls = dict(zip(names, card.examples[index], strict=True))
    label_names = card.clip_names(index)
    performer = label_names.pop(PERFORMER, None)
    numbers = float(distance), float(weight), float(share)
    return CapturedClip(card.sources[index], controls, performer, *numbers, label_names)


# Larger batches exceed a core's cache between operators and take 1.5 times as long per row.
BATCH = 1024


def grid(model: Synthesizer, question: SigmaQuestion) -> SigmaGrid:
    """Return the grid of sigma and support.

    Raises InvalidField for an unknown control or label, and for a value too far outside the
    sampled range.
    """
    card = model.session.card
    question_validation.check_names(card, question.controls)
    labels = question_validation.label_weights(card, question.performer, question.labels)
    across = _axis(card, "across", question.across, question.columns, question)
    along = _axis(card, "along", question.along, question.rows, question)
    fixed = _fixed(card, question)
    points = _points(card, across, along, fixed)
    sigma = _sigmas(model, points, labels)
    shape = question.rows, question.columns
    return SigmaGrid(
        model.identity,
        across,
        along,
        fixed,
        question.performer,
        sigma.reshape(shape),
        _inside(card, points).reshape(shape),
        model.validator.support.supported(points).reshape(shape),
        question.labels,
    )


def _sigmas(model: Synthesizer, points: Floats, labels: Floats) -> Singles:
    """Return sigma (B,), m, at points (B, d)."""
    batches = []
    for first in range(0, len(points), BATCH):
        cancellation.check()
        batches.append(
            model.session.run(points[first : first + BATCH], None, "sigma", labels=labels)[0]
        )
    return np.concatenate(batches)


def _axis(card: ModelCard, field: str, name: str, count: int, question: SigmaQuestion) -> GridAxis:
    control = card.control(name)
    if control is None:
        names = [c.name for c in card.controls]
        unknown = f"{name!r}{did_you_mean(name, names)}"
        raise InvalidField(
            field, f"{unknown}, expected one of this model's controls, {', '.join(names)}"
        )
    if name in question.controls:
        raise InvalidField(f"controls/{name}", f"given, and {field} the grid too; expected one")
    room = question.margin * (control.maximum - control.minimum)
    return GridAxis(control, np.linspace(control.minimum - room, control.maximum + room, count))


def _fixed(card: ModelCard, question: SigmaQuestion) -> dict[str, float]:
    """Return the values of the controls that are not axes, in the card's order."""
    values = {control.name: control.default for control in card.controls} | dict(question.controls)
    return {
        control.name: question_validation.check_control(control, values[control.name])
        for control in card.controls
        if control.name not in (question.across, question.along)
    }


def _points(
    card: ModelCard, across: GridAxis, along: GridAxis, fixed: Mapping[str, float]
) -> Floats:
    """Return the controls (R C, d) of the grid points in the card's order, row by row."""
    right, up = np.meshgrid(across.values, along.values)
    columns = {across.control.name: right.ravel(), along.control.name: up.ravel()}
    full = (columns.get(c.name, np.full(right.size, fixed.get(c.name))) for c in card.controls)
    return np.stack(list(full), axis=1)


def _inside(card: ModelCard, points: Floats) -> Booleans:
    low, high = np.transpose(
        [question_validation.sampled_range(control) for control in card.controls]
    )
    return np.all((points >= low) & (points <= high), axis=1)
