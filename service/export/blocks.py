"""Rows that lie one behind another in a source, column by column and not yet read."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from service.export.columns import Column

SIZE = 4096
"""Rows read together: more are no faster."""


@dataclass(frozen=True)
class Block:
    """Rows from the index `first` on; numbers: the line or row of each; cells: of each column;
    readers: how those are read."""

    first: int
    numbers: Sequence[int]
    columns: Sequence[Column]
    readers: Sequence[Callable[[Sequence[Any]], list[Any]]]
    cells: Sequence[Sequence[Any]]

    def __len__(self) -> int:
        return len(self.numbers)

    def part(self, start: int, stop: int) -> "Block":
        """Rows from start to before stop."""
        cells = [column[start:stop] for column in self.cells]
        numbers = self.numbers[start:stop]
        return Block(self.first + start, numbers, self.columns, self.readers, cells)

    def halves(self) -> Iterator["Block"]:
        """The former half and the latter."""
        middle = len(self) // 2
        yield self.part(0, middle)
        yield self.part(middle, len(self))

    def values(self) -> dict[str, list[Any]]:
        """Values of each field; ValueError says what is wrong with a cell if there is but one row.

        Columns that say nothing are left out.
        """
        columns = zip(self.columns, self.readers, self.cells, strict=True)
        found = {c.field: c.read(reader, cells) for c, reader, cells in columns}
        return {
            field: values
            for field, values in found.items()
            if any(value is not None for value in values)
        }


@dataclass(frozen=True)
class Broken:
    """A row that has no cells: its line or row, and what is wrong with it."""

    number: int
    message: str


@dataclass
class Gathering:
    """Rows of equal columns, gathered until a block is full.

    readers: of the columns. index: of the next row.
    """

    columns: Sequence[Column]
    readers: Sequence[Callable[[Sequence[Any]], list[Any]]]
    index: int = 0

    def __post_init__(self) -> None:
        self._numbers: list[int] = []
        self._rows: list[Sequence[Any]] = []

    def add(self, number: int, row: Sequence[Any]) -> bool:
        """Take a row; whether the block is full."""
        self._numbers.append(number)
        self._rows.append(row)
        return len(self._rows) == SIZE

    def broken(self, row: Broken) -> Iterator[Block | Broken]:
        """What was gathered, and then a row that has no cells."""
        yield from self.flush()
        self.index += 1
        yield row

    def flush(self) -> Iterator[Block]:
        """What was gathered, if anything."""
        numbers, rows = self._numbers, self._rows
        if rows:
            cells = list(zip(*rows, strict=True))
            yield Block(self.index, numbers, self.columns, self.readers, cells)
        self.index += len(rows)
        self._numbers, self._rows = [], []
