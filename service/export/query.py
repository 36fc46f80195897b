"""One clip of many: what it is called, what is asked for, and where that was said."""

from dataclasses import dataclass

from service.synthesis.question import ClipQuestion


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
