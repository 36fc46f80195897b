"""Queries at all points of a grid: `--grid speed=0.8:1.6:9 --grid stature=1.6,1.75`."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import prod
from typing import Any

import numpy as np

from posefield.batch.rows.cells import IntegerCell, NumberCell
from posefield.batch.rows.columns import Column, Columns
from posefield.batch.rows.row_blocks import BLOCK_SIZE, RowBlock
from posefield.common.errors import InvalidField
from posefield.model_file.model_card import ModelCard

MAX_POINTS = 10**9
"""Largest number of points; a greater one is considered a typing error."""
MAX_STEPS = 10**6
"""Largest number of values of one axis, which are held in memory."""


@dataclass(frozen=True)
class GridAxis:
    """A column and its values along the grid."""

    column: Column
    values: tuple[Any, ...]


@dataclass(frozen=True)
class ControlGrid:
    """All combinations of the axes' values; the last axis varies fastest.

    Controls without an axis have the card's default.
    """

    axes: tuple[GridAxis, ...]

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

    def blocks(self) -> Iterator[RowBlock]:
        """Yield the points in blocks, in order."""
        columns = [axis.column for axis in self.axes]
        readers = [column.kind.values for column in columns]
        shape = [len(axis.values) for axis in self.axes]
        for first in range(0, self.count, BLOCK_SIZE):
            points = range(first, min(first + BLOCK_SIZE, self.count))
            places = np.unravel_index(np.array(points), shape)
            cells = [_select_values(a.values, p) for a, p in zip(self.axes, places, strict=True)]
            yield RowBlock(first, [point + 1 for point in points], columns, readers, cells)


def parse_grid(texts: Sequence[str], columns: Columns, card: ModelCard) -> ControlGrid:
    """Return the grid of NAME=VALUES texts; InvalidField for a malformed or repeated one.

    VALUES: one value, several separated by commas, or `start:stop:count`, both ends included.
    """
    given = [_parse_axis(text, columns) for text in texts]
    named = [axis.column.field for axis in given]
    for name in named:
        if named.count(name) > 1:
            raise InvalidField("grid", f"{name.rpartition('/')[2]!r} twice, expected once")
    defaults = zip(columns.controls, card.controls, strict=True)
    rest = [
        GridAxis(column, (own.default,)) for column, own in defaults if column.field not in named
    ]
    grid = ControlGrid((*rest, *given))
    if grid.count > MAX_POINTS:
        raise InvalidField("grid", f"{grid.count} points, expected at most {MAX_POINTS}")
    return grid


def _parse_axis(text: str, columns: Columns) -> GridAxis:
    name, equals, values = text.partition("=")
    if not equals or not values:
        raise InvalidField("grid", f"{text!r}, expected NAME=VALUE,VALUE or NAME=START:STOP:COUNT")
    try:
        column = columns.find(name.strip())
        if column.field == "name":
            raise ValueError(f"column {name!r}, expected one that clips may share")
        if column.field == "targets":
            raise ValueError(f"column {name!r}, expected one whose values have no commas")
        return GridAxis(column, tuple(_parse_values(column, values)))
    except ValueError as fault:
        raise InvalidField("grid", f"{text!r}: {fault}") from fault


def _parse_values(column: Column, text: str) -> list[Any]:
    # Parsed one by one, so that an error names its value.
    if ":" in text and isinstance(column.kind, NumberCell | IntegerCell):
        return [column.read(column.kind.values, [value])[0] for value in _parse_steps(text)]
    values = [column.read(column.kind.text, [cell])[0] for cell in text.split(",")]
    if None in values:
        raise ValueError(f"an empty value, expected {column.kind.expected}")
    return values


def _parse_steps(text: str) -> list[float]:
    """Return the evenly spaced numbers of start:stop:count; ValueError for malformed text."""
    try:
        start, stop, steps = NumberCell().text(text.split(":"))
        (count,) = IntegerCell().values([steps])
    except ValueError as fault:
        raise ValueError(f"{text!r}, expected START:STOP:COUNT") from fault
    if start is None or stop is None or count is None or not 2 <= count <= MAX_STEPS:
        raise ValueError(f"{text!r}, expected START:STOP:COUNT with a COUNT of 2 to {MAX_STEPS}")
    return [float(value) for value in np.linspace(start, stop, count)]


def _select_values(values: Sequence[Any], places: Any) -> list[Any]:
    return [values[place] for place in places.tolist()]
