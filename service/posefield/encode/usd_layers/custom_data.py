"""Plain facts as values of USD dictionaries, which hold neither None nor mixed lists."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from pxr import Vt

LARGEST_INTEGER = 2**63 - 1
"""Largest integer that every reader of a layer supports."""


class FactList(NamedTuple):
    """A list of facts of one kind: str, int or float."""

    kind: type
    items: tuple[Any, ...]


ARRAYS = {str: Vt.StringArray, int: Vt.Int64Array, float: Vt.DoubleArray}
"""USD's array of each kind of list."""


def usd_dictionary(facts: Mapping[str, Any]) -> dict[str, Any]:
    """Return facts as values of a USD dictionary, without those that are None."""
    return {name: _usd_value(fact) for name, fact in facts.items() if fact is not None}


def plain_fact(fact: Any) -> Any:
    """Return a fact as what USD holds: a text, truth or number, a list of one kind, a dictionary.

    A mixed list is a dictionary by index, and an integer that readers do not support a text. Raises
    TypeError for any other value.
    """
    match fact:
        case np.generic() | np.ndarray():
            return plain_fact(fact.tolist())
        case Mapping():
            return dict(fact)
        case str():
            return str(fact)
        case bool():
            return fact
        case float():
            return float(fact)
        case int():
            return int(fact) if _is_supported(fact) else str(int(fact))
        case Sequence():
            return _plain_list(fact)
    raise TypeError(f"a fact of type {type(fact).__name__}, expected text, a number or several")


def _plain_list(facts: Sequence[Any]) -> FactList | dict[str, Any]:
    if all(isinstance(fact, str) for fact in facts):
        return FactList(str, tuple(facts))
    if all(_is_supported(fact) for fact in facts):
        return FactList(int, tuple(facts))
    if all(isinstance(fact, float | int) for fact in facts):
        return FactList(float, tuple(facts))
    return {str(index): fact for index, fact in enumerate(facts)}


def _is_supported(fact: Any) -> bool:
    return isinstance(fact, int) and abs(fact) <= LARGEST_INTEGER


def _usd_value(fact: Any) -> Any:
    plain = plain_fact(fact)
    if isinstance(plain, FactList):
        return ARRAYS[plain.kind](list(plain.items))
    return usd_dictionary(plain) if isinstance(plain, dict) else plain
