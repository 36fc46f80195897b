"""Plain facts as values of a USD dictionary, which knows no none and no mixed lists."""

import math
from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from pxr import Vt

LARGEST = 2**63 - 1
"""Of the integers that every reader of a layer can take."""


class Facts(NamedTuple):
    """Facts in parts: a shape that many answers share, and the numbers and texts that fill it."""

    shape: Hashable
    numbers: tuple[float, ...]
    texts: tuple[str, ...]

    def whole(self) -> Any:
        """The facts again."""
        return _joined(self.shape, iter(self.numbers), iter(self.texts))


@dataclass(frozen=True)
class Texts:
    """Place of so many texts in a list."""

    count: int


class Group(NamedTuple):
    """Facts by name, and the shape of each."""

    names: tuple[str, ...]
    shapes: tuple[Hashable, ...]


@dataclass(frozen=True)
class Same:
    """A fact that belongs to the shape: what is neither a finite number nor text."""

    spelt: str
    fact: Any = field(compare=False)


NUMBER, TEXT = "number", "text"
"""Places of a finite number, and of a text."""

NONE = Facts(Group((), ()), (), ())


def parted(facts: Mapping[str, Any]) -> Facts:
    """The same facts in parts."""
    numbers: list[float] = []
    texts: list[str] = []
    shape = _shape(facts, numbers, texts)
    return Facts(shape, tuple(numbers), tuple(texts))


def dictionary(facts: Mapping[str, Any]) -> dict[str, Any]:
    """The same facts, but for those that are None."""
    return {name: _value(fact) for name, fact in facts.items() if fact is not None}


def _shape(fact: Any, numbers: list[float], texts: list[str]) -> Hashable:
    kind = type(fact)
    if kind is float and math.isfinite(fact):
        numbers.append(fact)
        return NUMBER
    if kind is str:
        texts.append(fact)
        return TEXT
    if kind is dict:
        return Group(tuple(fact), tuple([_shape(each, numbers, texts) for each in fact.values()]))
    if kind is list and all(type(each) is str for each in fact):
        texts.extend(fact)
        return Texts(len(fact))
    return Same(repr(fact), fact)


def _joined(shape: Hashable, numbers: Iterator[float], texts: Iterator[str]) -> Any:
    match shape:
        case Group(names, shapes):
            values = (_joined(each, numbers, texts) for each in shapes)
            return dict(zip(names, values, strict=True))
        case "number":
            return next(numbers)
        case "text":
            return next(texts)
        case Texts(count):
            return [next(texts) for _ in range(count)]
        case Same(_, fact):
            return fact


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
