"""Plain facts as values of USD dictionaries, which hold neither None nor mixed lists."""

import math
from collections.abc import Hashable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from pxr import Vt

LARGEST_INTEGER = 2**63 - 1
"""Largest integer that every reader of a layer supports."""


class SplitFacts(NamedTuple):
    """Facts split into a shape, which many results share, and its numbers and texts."""

    shape: Hashable
    numbers: tuple[float, ...]
    texts: tuple[str, ...]

    def join(self) -> Any:
        """Return the facts as one value."""
        return _join_facts(self.shape, iter(self.numbers), iter(self.texts), self.texts)


class DictionaryShape(NamedTuple):
    """Shape of a dictionary: names, and the shape of each value."""

    names: tuple[str, ...]
    shapes: tuple[Hashable, ...]


class ListShape(NamedTuple):
    """Shape of a list of texts or dictionaries."""

    shapes: tuple[Hashable, ...]


class RepeatedText(NamedTuple):
    """Shape of a repeated text, the nth of all: USD stores it once."""

    nth: int


@dataclass(frozen=True)
class ConstantFact:
    """Shape of a fact that is a constant of the shape.

    Any fact that is neither a finite number nor a text, and a text that the layer holds elsewhere:
    the name of a fact, or a word of the character.
    """

    spelt: str
    fact: Any = field(compare=False)


NUMBER, TEXT = "number", "text"
"""Shapes of a finite number and of a text."""

NO_FACTS = SplitFacts(DictionaryShape((), ()), (), ())


def split_facts(facts: Mapping[str, Any], words: frozenset[str] = frozenset()) -> SplitFacts:
    """Return facts split into shape, numbers and texts.

    words: that the layer holds anyway, as the names of joints; USD stores them once.
    """
    parting = _FactSplitter(words, _fact_names(facts))
    shape = parting.shape(facts)
    return SplitFacts(shape, tuple(parting.numbers), tuple(parting.texts))


def usd_dictionary(facts: Mapping[str, Any]) -> dict[str, Any]:
    """Return facts as values of a USD dictionary, without those that are None."""
    return {name: _usd_value(fact) for name, fact in facts.items() if fact is not None}


@dataclass
class _FactSplitter:
    """Numbers and texts of facts, collected in order.

    words: of the character. names: of all facts. texts: index by text.
    """

    words: frozenset[str]
    names: Set[str]
    numbers: list[float] = field(default_factory=list)
    texts: dict[str, int] = field(default_factory=dict)

    def shape(self, fact: Any) -> Hashable:
        """Return the shape of a fact, and collect its numbers and texts."""
        kind = type(fact)
        if kind is float and math.isfinite(fact):
            self.numbers.append(fact)
            return NUMBER
        if kind is str:
            return self._text(fact)
        if kind is dict:
            return DictionaryShape(tuple(fact), tuple([self.shape(each) for each in fact.values()]))
        if kind is list and {*map(type, fact)} <= {str}:
            return ListShape(tuple([self._text(each) for each in fact]))
        if kind is list and {*map(type, fact)} == {dict}:
            return ListShape(tuple([self.shape(each) for each in fact]))
        return ConstantFact(repr(fact), fact)

    def _text(self, text: str) -> Hashable:
        if text in self.names or text in self.words:
            return ConstantFact(repr(text), text)
        if text in self.texts:
            return RepeatedText(self.texts[text])
        self.texts[text] = len(self.texts)
        return TEXT


def _fact_names(facts: Mapping[str, Any]) -> set[str]:
    """Return the names of facts, nested ones included."""
    found, rest = set[str](), list[Any]([facts])
    while rest:
        own = rest.pop()
        if type(own) is dict:
            found.update(own)
            own = own.values()
        rest += [each for each in own if type(each) is dict or type(each) is list]
    return found


def _join_facts(
    shape: Hashable, numbers: Iterator[float], texts: Iterator[str], every: Sequence[str]
) -> Any:
    match shape:
        case DictionaryShape(names, shapes):
            values = [_join_facts(each, numbers, texts, every) for each in shapes]
            return dict(zip(names, values, strict=True))
        case ListShape(shapes):
            return [_join_facts(each, numbers, texts, every) for each in shapes]
        case RepeatedText(nth):
            return every[nth]
        case ConstantFact(_, fact):
            return fact
    return next(numbers) if shape == NUMBER else next(texts)


def _usd_value(fact: Any) -> Any:
    match fact:
        case np.generic() | np.ndarray():
            return _usd_value(fact.tolist())
        case Mapping():
            return usd_dictionary(fact)
        case str() | bool() | float():
            return fact
        case int():
            return fact if abs(fact) <= LARGEST_INTEGER else str(fact)
        case Sequence():
            return _usd_array(fact)
    raise TypeError(f"a fact of type {type(fact).__name__}, expected text, a number or several")


def _usd_array(facts: Sequence[Any]) -> Any:
    if all(isinstance(fact, str) for fact in facts):
        return Vt.StringArray(list(facts))
    if all(isinstance(fact, int) and abs(fact) <= LARGEST_INTEGER for fact in facts):
        return Vt.Int64Array(list(facts))
    if all(isinstance(fact, float | int) for fact in facts):
        return Vt.DoubleArray(list(facts))
    return usd_dictionary({str(index): fact for index, fact in enumerate(facts)})
