"""Explanation of answers: the nearest captured clips and their kriging weights.

The poses of the finest level are a weighted sum of the captured clips in the coordinates of the
motion tensor; the weights depend on the controls and the performer, not on the time.
"""

from dataclasses import replace

import numpy as np

from posefield.common.units import Floats
from posefield.kriging import kriging_model, support
from posefield.model_file.model_card import PERFORMER, ModelCard
from posefield.question.model_question import WhyQuestion
from posefield.question.results import CapturedClip, Explanation, SupportReport
from posefield.synthesis.synthesizer import Synthesizer
from posefield.validation import question_validation
from posefield.validation.question_validation import QuestionValidator, ValidatedQuestion

NEAREST, MOST = 10, 10_000


def explain_result(model: Synthesizer, asked: WhyQuestion) -> Explanation:
    """Return the nearest captured clips, their weights and the support of an answer.

    Raises InvalidField and OutsideSamples as the validation of questions does.
    """
    card = model.session.card
    question = model.validator.question(
        asked.controls, asked.extrapolate, asked.performer, 0, asked.labels
    )
    distances = model.session.kriging_weights.distances(_point(card, question))[0]
    limited = model.session.bounds.limit(question.point).astype(np.float64)
    acting = replace(question, point=limited)
    weights = model.session.kriging_weights.weights(_point(card, acting))[0]
    order = np.argsort(distances, kind="stable")
    near, others = order[: asked.nearest], order[asked.nearest :]
    shares = positive_shares(weights)
    found = tuple(
        _captured_clip(card, i, distances[i], weights[i], shares[i]) for i in near.tolist()
    )
    rest = float(weights[others].sum()), float(shares[others].sum())
    controls, who = question.controls, question.performer
    said = question_validation.merge_warnings(
        question.warnings, question.deviations, asked.extrapolate
    )
    inferred, backing = question.inferred, _support_report(model.validator, question)
    return Explanation(
        model.identity,
        controls,
        who,
        said,
        backing,
        found,
        len(others),
        *rest,
        inferred,
        question.named,
    )


def positive_shares(weights: Floats) -> Floats:
    """Return the parts (n,) of the positive weights (n,) in their sum; 0 for a negative weight.

    Kriging weights sum to one, so at least one is positive.
    """
    positive = np.maximum(weights, 0.0)
    return positive / positive.sum()


def _support_report(door: QuestionValidator, question: ValidatedQuestion) -> SupportReport:
    own = door.support
    beyond = dict(zip(question.controls, own.beyond(question.point)[0].tolist(), strict=True))
    variance = float(own.variance(question.point)[0])
    return SupportReport(question.supported, beyond, support.RANGE_MARGIN, variance, own.limit)


def _point(card: ModelCard, question: ValidatedQuestion) -> Floats:
    """Return the point (1, d + p) of the kriging model."""
    place = kriging_model.half_ranges(question.point, *card.sampled_ranges)
    return np.hstack([place, question.labels])


def _captured_clip(
    card: ModelCard, index: int, distance: float, weight: float, share: float
) -> CapturedClip:
    names = (control.name for control in card.controls)
    controls = dict(zip(names, card.examples[index], strict=True))
    named = card.clip_names(index)
    who = named.pop(PERFORMER, None)
    numbers = float(distance), float(weight), float(share)
    return CapturedClip(card.sources[index], controls, who, *numbers, named)
