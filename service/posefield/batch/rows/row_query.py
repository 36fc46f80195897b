"""Queries of clips, faults of rows, and the protocol of their sources."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

from posefield.question.motion_question import ClipQuestion

MAX_KEPT_FAULTS = 20
"""Number of faults that a survey keeps."""


@dataclass(frozen=True)
class ClipQuery:
    """A clip to be made.

    name: of the clip. format: of its file. question: its question. place: origin in the source,
    such as "line 7".
    """

    name: str
    format: str
    question: ClipQuestion
    place: str


@dataclass(frozen=True)
class RowFault:
    """An invalid row: its origin in the source, and the reason."""

    place: str
    message: str


@dataclass(frozen=True)
class RowSurvey:
    """Result of the first pass through all rows.

    total: number of rows. faulty: number of invalid ones. faults: the first of those.
    """

    total: int
    faulty: int
    faults: tuple[RowFault, ...]


class RowSource(Protocol):
    """Source of queries: the same rows in the same order at every reading.

    A reader holds a few thousand rows in memory, and 8 bytes of each given name.
    """

    @property
    def digest(self) -> str:
        """SHA-256 of all parameters and data that determine the queries, except the model."""

    def rows(self) -> Iterator[ClipQuery | RowFault]:
        """Yield every row; FileError if the rest cannot be read or has changed."""

    def survey(self) -> RowSurvey:
        """Validate every row without keeping any; raises as `rows` does."""
