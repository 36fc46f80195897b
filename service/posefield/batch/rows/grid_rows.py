"""Queries at all points of a grid: `--grid speed=0.8:1.6:9 --grid stature=1.6,1.75`."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import prod
from typing import Any

import numpy as np

from posefield.batch.rows.cells import Number, Whole
from posefield.batch.rows.columns import Column, Columns
from posefield.batch.rows.row_blocks import SIZE, Block
from posefield.common.errors import InvalidField
from posefield.model_file.model_card import ModelCard

MOST = 10**9
"""Largest number of points; a greater one is considered a typing error."""
MOST_STEPS = 10**6
"""Largest number of values of one axis, which are held in memory."""


@dataclass(frozen=True)
class Axis:
    """A column and its values along the grid."""

    column: Column
    values: tuple[Any, ...]


@dataclass(frozen=True)
class Grid:
    """All combinations of the axes' values; the last axis varies fastest.

    Controls without an axis have the card's default.
    """

    axes: tuple[Axis, ...]

    @property
    def count(self) -> int:
        """Number of points."""
        return prod(len(axis.values) for axis in self.axes)

    def place(self, point: int) -> str:
        """Return the name of a point for messages."""
        return f"grid point {point}"

    def spec(self) -> dict[str, Any]:
        """Return all parameters that determine the points, as plain values."""
        return {"grid": [[axis.column.field, list(axis.values)] for axis in self.axes]}

    def blocks(self) -> Iterator[Block]:
        """Yield the points in blocks, in order."""
        columns = [axis.column for axis in self.axes]
        readers = [column.kind.values for column in columns]
        shape = [len(axis.values) for axis in self.axes]
        for first in range(0, self.count, SIZE):
            points = range(first, min(first + SIZE, self.count))
            places = np.unravel_index(np.array(points), shape)
            cells = [_taken(a.values, p) for a, p in zip(self.axes, places, strict=True)]
            yield Block(first, [point + 1 for point in points], columns, readers, cells)


def parse(texts: Sequence[str], columns: Columns, card: ModelCard) -> Grid:
    """Return the grid of NAME=VALUES texts; InvalidField for a malformed or repeated one.

    VALUES: one value, several separated by commas, or `start:stop:count`, both ends included.
    """
    given = [_axis(text, columns) for text in texts]
    named = [axis.column.field for axis in given]
    for name in named:
        if named.count(name) > 1:
            raise InvalidField("grid", f"{name.rpartition('/')[2]!r} twice, expected once")
    defaults = zip(columns.controls, card.controls, strict=True)
    rest = [Axis(column, (own.default,)) for column, own in defaults if column.field not in named]
    grid = Grid((*rest, *given))
    if grid.count > MOST:
        raise InvalidField("grid", f"{grid.count} points, expected at most {MOST}")
    return grid


def _axis(text: str, columns: Columns) -> Axis:
    name, equals, values = text.partition("=")
    if not equals or not values:
        raise InvalidField("grid", f"{text!r}, expected NAME=VALUE,VALUE or NAME=START:STOP:COUNT")
    try:
        column = columns.find(name.strip())
        if column.field == "name":
            raise ValueError(f"column {name!r}, expected one that clips may share")
        if column.field == "targets":
            raise ValueError(f"column {name!r}, expected one whose values have no commas")
        return Axis(column, tuple(_values(column, values)))
    except ValueError as fault:
        raise InvalidField("grid", f"{text!r}: {fault}") from fault


def _values(column: Column, text: str) -> list[Any]:
    # Parsed one by one, so that an error names its value.
    if ":" in text and isinstance(column.kind, Number | Whole):
        return [column.read(column.kind.values, [value])[0] for value in _steps(text)]
    values = [column.read(column.kind.text, [cell])[0] for cell in text.split(",")]
    if None in values:
        raise ValueError(f"an empty value, expected {column.kind.expected}")
    return values


def _steps(text: str) -> list[float]:
    """Return the evenly spaced numbers of start:stop:count; ValueError for malformed text."""
    try:
        start, stop, steps = Number().text(text.split(":"))
        (count,) = Whole().values([steps])
    except ValueError as fault:
        raise ValueError(f"{text!r}, expected START:STOP:COUNT") from fault
    if start is None or stop is None or count is None or not 2 <= count <= MOST_STEPS:
        raise ValueError(f"{text!r}, expected START:STOP:COUNT with a COUNT of 2 to {MOST_STEPS}")
    return [float(value) for value in np.linspace(start, stop, count)]


def _taken(values: Sequence[Any], places: Any) -> list[Any]:
    return [values[place] for place in places.tolist()]
