"""Why an answer is as it is: which captured clips are near, and what each counts for.

The poses of the finest level are a weighted sum of the captured clips in the coordinates of the
motion tensor, with weights that hang on the controls and the performer alone, not on the time.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from service.motion import field, support
from service.motion.answer import Backing, Captured, Reasons
from service.motion.card import ModelCard
from service.motion.conventions import Floats
from service.motion.errors import InvalidField
from service.synthesis import limits
from service.synthesis.door import Door, Question
from service.synthesis.question import Policy
from service.synthesis.synthesizer import Synthesizer

NEAREST, MOST = 10, 10_000
OLD = "expected one that says what its weights hang on; train it again"


@dataclass(frozen=True)
class WhyQuestion:
    """Which answer: control values and who moves, nobody that was seen for none; nearest: how many
    captured clips are listed."""

    controls: Mapping[str, float]
    extrapolate: Policy
    performer: str | None = None
    nearest: int = NEAREST

    def __post_init__(self) -> None:
        limits.within("nearest", self.nearest, 1, MOST, "clips")


def why(model: Synthesizer, asked: WhyQuestion) -> Reasons:
    """Reasons for the answer at these controls.

    Raises as `poses.pose` does, and InvalidField for a model that was trained before cards
    said what weights hang on.
    """
    card = model.session.card
    if card.kriging is None:
        raise InvalidField("model", f"{model.identity}, {OLD}")
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
    """Point (1, d + p) of the field."""
    low, high = np.transpose([(c.minimum, c.maximum) for c in card.controls])
    return np.hstack([field.half_ranges(question.point, low, high), question.labels])


def _captured(card: ModelCard, index: int, distance: float, weight: float) -> Captured:
    names = (control.name for control in card.controls)
    controls = dict(zip(names, card.examples[index], strict=True))
    who = card.performers[card.moved_by[index]] if card.moved_by else None
    return Captured(card.sources[index], controls, who, float(distance), float(weight))
