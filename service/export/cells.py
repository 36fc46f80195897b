"""What the cells of one column may hold, and how they are read.

Each kind reads many cells at once, and raises ValueError where any of them is wrong: which one it
was shows when it is read alone. None is a cell that says nothing.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from service.synthesis import question, spelling
from service.synthesis.question import Target

LEGAL_NAME = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9._-]{0,99}", re.ASCII)


class Kind(Protocol):
    """How cells of a column are read, from text and from values of JSON or Parquet."""

    @property
    def expected(self) -> str:
        """What a cell should hold, for messages."""

    def text(self, cells: Sequence[str]) -> list[Any]:
        """Values of cells of text; an empty one says nothing."""

    def values(self, cells: Sequence[Any]) -> list[Any]:
        """Values of cells that have types."""


@dataclass(frozen=True)
class Number:
    """Numbers, in a unit if one is stated."""

    unit: str | None = None

    @property
    def expected(self) -> str:
        return f"a number in {self.unit}" if self.unit else "a number"

    def text(self, cells: Sequence[str]) -> list[float | None]:
        together = "".join(cells)
        # Python reads 1_000 and digits of other scripts as numbers; a table means something else.
        if "_" in together or not together.isascii():
            raise ValueError
        return [float(cell) if cell else None for cell in cells]

    def values(self, cells: Sequence[Any]) -> list[float | None]:
        # True is a number to Python.
        if not set(map(type, cells)) <= {float, int, type(None)}:
            raise ValueError
        try:
            return [None if cell is None else float(cell) for cell in cells]
        except OverflowError as fault:
            raise ValueError from fault


@dataclass(frozen=True)
class Whole:
    """Whole numbers, also where a column with gaps has turned them into 1.0 and 2.0."""

    expected: str = "a whole number"

    def text(self, cells: Sequence[str]) -> list[int | None]:
        return self.values(Number().text(cells))

    def values(self, cells: Sequence[Any]) -> list[int | None]:
        numbers = Number().values(cells)
        if not all(number is None or number.is_integer() for number in numbers):
            raise ValueError
        return [None if number is None else int(number) for number in numbers]


@dataclass(frozen=True)
class Word:
    """One of a few words."""

    choices: tuple[str, ...]

    @property
    def expected(self) -> str:
        return f"one of {', '.join(self.choices)}" if self.choices else "none: there are none"

    def text(self, cells: Sequence[str]) -> list[str | None]:
        return self.values([cell or None for cell in cells])

    def values(self, cells: Sequence[Any]) -> list[str | None]:
        # A list or an object of JSON has no hash.
        if not set(map(type, cells)) <= {str, type(None)} or not {*cells} <= {*self.choices, None}:
            raise ValueError
        return list(cells)


@dataclass(frozen=True)
class Flag:
    """True or false."""

    expected: str = "true or false"

    def text(self, cells: Sequence[str]) -> list[bool | None]:
        spelt = {"": None, "true": True, "false": False}
        try:
            return [spelt[cell.lower()] for cell in cells]
        except KeyError as fault:
            raise ValueError from fault

    def values(self, cells: Sequence[Any]) -> list[bool | None]:
        if not set(map(type, cells)) <= {bool, type(None)}:
            raise ValueError
        return list(cells)


@dataclass(frozen=True)
class Exact:
    """Which measured controls a clip is held to: auto, none, or names with commas between; of JSON
    and Parquet also a list of names."""

    expected: str = "auto, none or names of controls, commas between"

    def text(self, cells: Sequence[str]) -> list[question.Exact | None]:
        return [spelling.exact(cell) if cell else None for cell in cells]

    def values(self, cells: Sequence[Any]) -> list[question.Exact | None]:
        return [_exact(cell) for cell in cells]


def _exact(cell: object) -> question.Exact | None:
    if isinstance(cell, list) and cell and {*map(type, cell)} == {str}:
        return tuple(cell)
    if cell is None or isinstance(cell, str):
        return spelling.exact(cell) if cell else None
    raise ValueError


@dataclass(frozen=True)
class Targets:
    """Targets of a clip: as text JOINT@MOMENT:X,Y,Z with semicolons between, else a list of
    objects with joint, position and time or at."""

    expected: str = "targets: JOINT@MOMENT:X,Y,Z; ... in text, else a list of objects"

    def text(self, cells: Sequence[str]) -> list[tuple[Target, ...] | None]:
        return [_targets(cell) for cell in cells]

    def values(self, cells: Sequence[Any]) -> list[tuple[Target, ...] | None]:
        return [_targets(cell) for cell in cells]


def _targets(cell: object) -> tuple[Target, ...] | None:
    if cell is None or cell == "":
        return None
    if isinstance(cell, str):
        return tuple(spelling.target(words.strip()) for words in cell.split(";"))
    if not isinstance(cell, list):
        raise ValueError
    return tuple(map(spelling.plain_target, cell))


@dataclass(frozen=True)
class Name:
    """Names that can be file names everywhere."""

    expected: str = "1 to 100 of the letters A to Z, digits, '.', '_' and '-', not '.' first"

    def text(self, cells: Sequence[str]) -> list[str | None]:
        return self.values([cell or None for cell in cells])

    def values(self, cells: Sequence[Any]) -> list[str | None]:
        said = [cell for cell in cells if cell is not None]
        if not set(map(type, said)) <= {str} or not all(map(LEGAL_NAME.fullmatch, said)):
            raise ValueError
        return list(cells)
