"""Label sets of a model, such as performer and style, and what a request says of them."""

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import faults

PERFORMER = "performer"

LabelValue = str | dict[str, float]
"""One name of a label set, or weights of several names."""


@dataclass(frozen=True)
class LabelSet:
    """A label set of a model, and the names that a request may give."""

    name: str
    names: tuple[str, ...]


def of_card(plain: Mapping[str, Any]) -> tuple[LabelSet, ...]:
    """Return the label sets of a card; services older than 3.1.0 list performers alone."""
    if "labels" in plain:
        return tuple(_label_set(each["name"], each["names"]) for each in plain["labels"])
    performers = plain["performers"]
    return (_label_set(PERFORMER, performers),) if performers else ()


def fields(labels: Mapping[str, LabelValue]) -> dict[str, Any]:
    """Return the fields `performer` and `labels` of a request.

    A performer's name is in `performer`, and `labels` is left out if it is empty, since services
    older than 3.1.0 do not know that field.
    """
    others = dict(labels)
    name = others.pop(PERFORMER) if isinstance(labels.get(PERFORMER), str) else None
    return {"performer": name} | ({"labels": others} if others else {})


def of_trust(trust: Mapping[str, Any]) -> dict[str, LabelValue]:
    """Return the requested label or weights of each set; open sets are left out."""
    name = trust.get("performer")
    return {**trust.get("labels", {}), **({} if name is None else {PERFORMER: name})}


def of_json(text: str, sets: Iterable[LabelSet]) -> dict[str, LabelValue | None]:
    """Return names, weights, or None for open sets, by label set.

    Raises Fault for other text, for a set that the model does not have, and for weights that are
    not finite numbers.
    """
    expected = f"labels are {text!r}, expected a name, weights by name or null by label set"
    try:
        given = json.loads(text or "{}")
        found = {name: _value(value) for name, value in given.items()}
    except (ValueError, TypeError, AttributeError) as fault:
        raise faults.Fault(expected) from fault
    known = [each.name for each in sets]
    unknown = sorted(set(found) - set(known))
    if unknown:
        there = f"there are {', '.join(known)}" if known else "the model has none"
        raise faults.Fault(f"no label set is named {unknown[0]}; {there}")
    return found


def weights(sliders: Mapping[str, float]) -> dict[str, float]:
    """Return the weights above 0 of sliders, which hold float32: 0.7 becomes 0.699999988."""
    return {name: float(str(np.float32(value))) for name, value in sliders.items() if value > 0}


def _label_set(name: Any, names: Any) -> LabelSet:
    return LabelSet(str(name), tuple(str(each) for each in names))


def _value(value: Any) -> LabelValue | None:
    if value is None or isinstance(value, str):
        return value
    found = {str(name): float(weight) for name, weight in value.items()}
    if not all(map(math.isfinite, found.values())):
        raise ValueError("weights that are not finite")
    return found
