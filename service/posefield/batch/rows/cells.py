"""Kinds of cells, each with its parsers for text and for typed values.

A kind parses many cells at once and raises ValueError if one of them is invalid; parsing that cell
alone identifies it. None is an empty cell.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import msgspec

from posefield.question import text_decoding
from posefield.question.motion_question import (
    LEGAL_NAME,
    ExactControls,
    FloorValue,
    LabelValue,
    Target,
)


class CellKind(Protocol):
    """Parsers of a column's cells, for text and for values of JSON or Parquet."""

    @property
    def expected(self) -> str:
        """Description of a valid cell, for messages."""

    def text(self, cells: Sequence[str]) -> list[Any]:
        """Return the values of text cells; None for an empty one."""

    def values(self, cells: Sequence[Any]) -> list[Any]:
        """Return the values of typed cells."""


@dataclass(frozen=True)
class NumberCell:
    """Numbers, with an optional unit."""

    unit: str | None = None

    @property
    def expected(self) -> str:
        return f"a number in {self.unit}" if self.unit else "a number"

    def text(self, cells: Sequence[str]) -> list[float | None]:
        together = "".join(cells)
        # float() accepts 1_000 and digits of other scripts; in a table they are errors.
        if "_" in together or not together.isascii():
            raise ValueError
        return [float(cell) if cell else None for cell in cells]

    def values(self, cells: Sequence[Any]) -> list[float | None]:
        # bool is a subclass of int.
        if not set(map(type, cells)) <= {float, int, type(None)}:
            raise ValueError
        try:
            return [None if cell is None else float(cell) for cell in cells]
        except OverflowError as fault:
            raise ValueError from fault


@dataclass(frozen=True)
class IntegerCell:
    """Whole numbers, also as floats such as 1.0, which columns with gaps are converted to."""

    expected: str = "a whole number"

    def text(self, cells: Sequence[str]) -> list[int | None]:
        return self.values(NumberCell().text(cells))

    def values(self, cells: Sequence[Any]) -> list[int | None]:
        numbers = NumberCell().values(cells)
        if not all(number is None or number.is_integer() for number in numbers):
            raise ValueError
        return [None if number is None else int(number) for number in numbers]


@dataclass(frozen=True)
class ChoiceCell:
    """One of a list of words."""

    choices: tuple[str, ...]

    @property
    def expected(self) -> str:
        return f"one of {', '.join(self.choices)}" if self.choices else "none: there are none"

    def text(self, cells: Sequence[str]) -> list[str | None]:
        return self.values([cell or None for cell in cells])

    def values(self, cells: Sequence[Any]) -> list[str | None]:
        # Lists and objects of JSON are not hashable.
        if not set(map(type, cells)) <= {str, type(None)} or not {*cells} <= {*self.choices, None}:
            raise ValueError
        return list(cells)


@dataclass(frozen=True)
class LabelCell:
    """One name of a label set, or weights of several.

    Weights are NAME:WEIGHT,NAME:WEIGHT in text, else also an object of them.
    """

    names: tuple[str, ...]

    @property
    def expected(self) -> str:
        return f"one of {', '.join(self.names)}, or NAME:WEIGHT,NAME:WEIGHT"

    def text(self, cells: Sequence[str]) -> list[LabelValue | None]:
        return [self._checked(cell) if cell else None for cell in cells]

    def values(self, cells: Sequence[Any]) -> list[LabelValue | None]:
        return [None if cell is None else self._checked(cell) for cell in cells]

    def _checked(self, cell: object) -> LabelValue:
        """Return the label of a cell; ValueError for an unknown name."""
        value = text_decoding.parse_label_value(cell) if isinstance(cell, str) else cell
        found: LabelValue = msgspec.convert(value, LabelValue)
        if not {*([found] if isinstance(found, str) else found)} <= {*self.names}:
            raise ValueError
        return found


@dataclass(frozen=True)
class BooleanCell:
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
class ExactCell:
    """Measured controls that a clip must match: auto, none, or comma-separated names.

    JSON and Parquet may have a list of names instead.
    """

    expected: str = "auto, none or names of controls, commas between"

    def text(self, cells: Sequence[str]) -> list[ExactControls | None]:
        return [text_decoding.parse_exact(cell) if cell else None for cell in cells]

    def values(self, cells: Sequence[Any]) -> list[ExactControls | None]:
        return [_parse_exact(cell) for cell in cells]


def _parse_exact(cell: object) -> ExactControls | None:
    if isinstance(cell, list) and cell and {*map(type, cell)} == {str}:
        return tuple(cell)
    if cell is None or isinstance(cell, str):
        return text_decoding.parse_exact(cell) if cell else None
    raise ValueError


@dataclass(frozen=True)
class FloorCell:
    """Floors: HEIGHT or HEIGHT,SLOPE_X,SLOPE_Z in text, else a number or an object.

    The object has the keys height, slope_x and slope_z.
    """

    expected: str = "a height in m, or HEIGHT,SLOPE_X,SLOPE_Z"

    def text(self, cells: Sequence[str]) -> list[FloorValue | None]:
        return [text_decoding.parse_floor(cell) if cell else None for cell in cells]

    def values(self, cells: Sequence[Any]) -> list[FloorValue | None]:
        return [_parse_floor(cell) for cell in cells]


def _parse_floor(cell: object) -> FloorValue | None:
    if cell is None or isinstance(cell, str):
        return text_decoding.parse_floor(cell) if cell else None
    try:
        found: FloorValue = msgspec.convert(cell, FloorValue)
    except msgspec.ValidationError as fault:
        raise ValueError(str(fault)) from None
    return found


@dataclass(frozen=True)
class TargetsCell:
    """Targets of a clip: JOINT@MOMENT:X,Y,Z; ... in text, else a list of objects.

    The objects have the keys joint, position, and time or at.
    """

    expected: str = "targets: JOINT@MOMENT:X,Y,Z; ... in text, else a list of objects"

    def text(self, cells: Sequence[str]) -> list[tuple[Target, ...] | None]:
        return [_parse_targets(cell) for cell in cells]

    def values(self, cells: Sequence[Any]) -> list[tuple[Target, ...] | None]:
        return [_parse_targets(cell) for cell in cells]


def _parse_targets(cell: object) -> tuple[Target, ...] | None:
    if cell is None or cell == "":
        return None
    if isinstance(cell, str):
        return tuple(text_decoding.parse_target(part.strip()) for part in cell.split(";"))
    try:
        return msgspec.convert(cell, tuple[Target, ...])
    except msgspec.ValidationError as fault:
        raise ValueError(str(fault)) from None


@dataclass(frozen=True)
class NameCell:
    """Names that are valid file names on every system."""

    expected: str = "1 to 100 of the letters A to Z, digits, '.', '_' and '-', not '.' first"

    def text(self, cells: Sequence[str]) -> list[str | None]:
        return self.values([cell or None for cell in cells])

    def values(self, cells: Sequence[Any]) -> list[str | None]:
        said = [cell for cell in cells if cell is not None]
        if not set(map(type, said)) <= {str} or not all(map(LEGAL_NAME.fullmatch, said)):
            raise ValueError
        return list(cells)
