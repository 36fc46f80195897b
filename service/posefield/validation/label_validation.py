"""Validation of labels: names of a model's label sets, and weights of several names."""

from collections.abc import Mapping

import numpy as np

from posefield.common.errors import InvalidField
from posefield.common.name_suggestion import did_you_mean
from posefield.common.units import Floats
from posefield.model_file.model_card import PERFORMER, LabelSet, ModelCard
from posefield.question.motion_question import LabelValue
from posefield.question.value_validation import check_number
from posefield.validation.input_limits import accepted_names

ROUNDING = 1e-6
"""Excess of a sum of weights over one that is the rounding of clients."""


def label_weights(
    card: ModelCard, performer: str | None, named: Mapping[str, LabelValue]
) -> Floats:
    """Return the weights (1, p) of the names of all label sets, for the graph.

    Those of a set are zero if it is left open. performer: short for the name in the label set
    `performer`. named: name or weights by label set. Raises InvalidField for an unknown set or
    name, for invalid weights, and for a performer given in both ways.
    """
    if performer is not None:
        if PERFORMER in named:
            raise InvalidField("performer", f"{performer!r} and labels/performer, expected one")
        check_name("performer", performer, card.performers)
    for name in named:
        _check_set(card, name)
    short = {} if performer is None else {PERFORMER: performer}
    asked: Mapping[str, LabelValue] = {**named, **short}
    rows = [_set_weights(own, asked.get(own.name)) for own in card.labels]
    return np.array([[weight for row in rows for weight in row]], dtype=np.float64)


def check_name(field: str, name: str, known: tuple[str, ...]) -> None:
    """Raise InvalidField for a name that is not among the known ones of its label set."""
    if name not in known:
        expected = f"expected {accepted_names(known)}"
        raise InvalidField(field, f"{name!r}{did_you_mean(name, known)}, {expected}")


def _check_set(card: ModelCard, name: str) -> None:
    known = tuple(own.name for own in card.labels)
    if name not in known:
        found = f"{name!r}{did_you_mean(name, known)}"
        expected = (
            f"one of the label sets {', '.join(known)}" if known else "none: this model has none"
        )
        raise InvalidField(f"labels/{name}", f"{found}, expected {expected}")


def _set_weights(own: LabelSet, asked: LabelValue | None) -> list[float]:
    """Return the weight of each name of a set; zeros for None."""
    if asked is None:
        return [0.0] * len(own.names)
    field = f"labels/{own.name}"
    if isinstance(asked, str):
        check_name(field, asked, own.names)
        return [float(name == asked) for name in own.names]
    for name, weight in asked.items():
        check_name(field, name, own.names)
        if check_number(f"{field}/{name}", weight) < 0.0:
            raise InvalidField(f"{field}/{name}", f"{weight:g}, expected a weight of 0 to 1")
    total = sum(asked.values())
    if not 0.0 < total <= 1.0 + ROUNDING:
        raise InvalidField(
            field,
            f"weights with a sum of {total:.6g}, expected one above 0 and at most 1; what is left "
            "to 1 stays open",
        )
    return [float(asked.get(name, 0.0)) for name in own.names]
