"""One clip of many: what it is called, what is asked for, and where that was said."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

from service.synthesis.question import ClipQuestion

KEPT = 20
"""Faults that a survey keeps of all that it counts."""


@dataclass(frozen=True)
class Query:
    """A clip to be made: its name, its format and the question; place: where it was read, such as
    "line 7"."""

    name: str
    format: str
    question: ClipQuestion
    place: str


@dataclass(frozen=True)
class Fault:
    """A row that is no query: where it was read and what is wrong with it."""

    place: str
    message: str


@dataclass(frozen=True)
class Survey:
    """What a first look at all rows found: how many there are, how many are no queries, and the
    first of those."""

    total: int
    faulty: int
    faults: tuple[Fault, ...]


class Source(Protocol):
    """Where queries come from: the same rows in the same order whenever they are read.

    Whoever reads holds a few thousand rows, and 8 bytes of each name that was given.
    """

    @property
    def digest(self) -> str:
        """SHA-256 of all that the queries hang on, but for the model."""

    @property
    def count(self) -> int | None:
        """How many rows there are; none where that is known only after they were read."""

    def rows(self) -> Iterator[Query | Fault]:
        """Every row. Raises FileError where the rest cannot be read, or has changed since."""

    def survey(self) -> Survey:
        """Every row looked at and none kept. Raises as `rows` does."""
