"""Plain facts as values of a USD dictionary, which knows no none and no mixed lists."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from pxr import Vt

LARGEST = 2**63 - 1
"""Of the integers that every reader of a layer can take."""


def dictionary(facts: Mapping[str, Any]) -> dict[str, Any]:
    """The same facts, but for those that are None."""
    return {name: _value(fact) for name, fact in facts.items() if fact is not None}


def _value(fact: Any) -> Any:
    match fact:
        case np.generic() | np.ndarray():
            return _value(fact.tolist())
        case Mapping():
            return dictionary(fact)
        case str() | bool() | float():
            return fact
        case int():
            return fact if abs(fact) <= LARGEST else str(fact)
        case Sequence():
            return _array(fact)
    raise TypeError(f"a fact of type {type(fact).__name__}, expected text, a number or several")


def _array(facts: Sequence[Any]) -> Any:
    if all(isinstance(fact, str) for fact in facts):
        return Vt.StringArray(list(facts))
    if all(isinstance(fact, int) and abs(fact) <= LARGEST for fact in facts):
        return Vt.Int64Array(list(facts))
    if all(isinstance(fact, float | int) for fact in facts):
        return Vt.DoubleArray(list(facts))
    return dictionary({str(index): fact for index, fact in enumerate(facts)})
