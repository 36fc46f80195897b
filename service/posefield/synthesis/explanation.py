"""Explanation of answers: the nearest captured clips and their kriging weights.

The poses of the finest level are a weighted sum of the captured clips in the coordinates of the
motion tensor; the weights depend on the controls and the performer, not on the time.
"""

import numpy as np

from posefield.common.units import Floats
from posefield.kriging import kriging_model, support
from posefield.model_file.model_card import ModelCard
from posefield.question.model_question import WhyQuestion
from posefield.question.results import Backing, Captured, Reasons
from posefield.synthesis.synthesizer import Synthesizer
from posefield.validation.question_validation import Door, Question

NEAREST, MOST = 10, 10_000


def why(model: Synthesizer, asked: WhyQuestion) -> Reasons:
    """Return the nearest captured clips, their weights and the support of an answer.

    Raises InvalidField and OutsideSamples as the validation of questions does.
    """
    card = model.session.card
    question = model.door.question(asked.controls, asked.extrapolate, asked.performer, level=0)
    point = _point(card, question)
    distances = model.session.weigher.distances(point)[0]
    weights = model.session.weigher.weights(point)[0]
    order = np.argsort(distances, kind="stable")
    near, others = order[: asked.nearest], order[asked.nearest :]
    found = tuple(_captured(card, i, distances[i], weights[i]) for i in near.tolist())
    rest = float(weights[others].sum())
    controls, who, said = question.controls, question.performer, question.warnings
    inferred, backing = question.inferred, _backing(model.door, question)
    rests = len(others), rest
    return Reasons(model.identity, controls, who, said, backing, found, *rests, inferred)


def _backing(door: Door, question: Question) -> Backing:
    own = door.support
    beyond = dict(zip(question.controls, own.beyond(question.point)[0].tolist(), strict=True))
    variance = float(own.variance(question.point)[0])
    return Backing(question.supported, beyond, support.BEYOND, variance, own.limit)


def _point(card: ModelCard, question: Question) -> Floats:
    """Return the point (1, d + p) of the kriging model."""
    low, high = np.transpose([(c.minimum, c.maximum) for c in card.controls])
    return np.hstack([kriging_model.half_ranges(question.point, low, high), question.labels])


def _captured(card: ModelCard, index: int, distance: float, weight: float) -> Captured:
    names = (control.name for control in card.controls)
    controls = dict(zip(names, card.examples[index], strict=True))
    who = card.performers[card.moved_by[index]] if card.moved_by else None
    return Captured(card.sources[index], controls, who, float(distance), float(weight))
