"""Blocks of consecutive rows of a source, as columns of cells that are not yet parsed."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from posefield.batch.rows.columns import Column

BLOCK_SIZE = 4096
"""Rows of a block; larger blocks are no faster."""


@dataclass(frozen=True)
class RowBlock:
    """Consecutive rows of a source.

    first: index of the first row. numbers: the line or row number of each, for messages. columns:
    the columns. readers: parser of each column's cells. cells: cells of each column.
    """

    first: int
    numbers: Sequence[int]
    columns: Sequence[Column]
    readers: Sequence[Callable[[Sequence[Any]], list[Any]]]
    cells: Sequence[Sequence[Any]]

    def __len__(self) -> int:
        return len(self.numbers)

    def part(self, start: int, stop: int) -> "RowBlock":
        """Return the rows from `start` to before `stop`."""
        cells = [column[start:stop] for column in self.cells]
        numbers = self.numbers[start:stop]
        return RowBlock(self.first + start, numbers, self.columns, self.readers, cells)

    def halves(self) -> Iterator["RowBlock"]:
        """Yield the first and the second half of the rows."""
        middle = len(self) // 2
        yield self.part(0, middle)
        yield self.part(middle, len(self))

    def values(self) -> dict[str, list[Any]]:
        """Return the values of each field; columns without any value are left out.

        Raises ValueError for an invalid cell; the message is exact if the block has one row.
        """
        columns = zip(self.columns, self.readers, self.cells, strict=True)
        found = {c.field: c.read(reader, cells) for c, reader, cells in columns}
        return {
            field: values
            for field, values in found.items()
            if any(value is not None for value in values)
        }


@dataclass(frozen=True)
class BrokenRow:
    """A row that cannot be split into cells: its line or row number, and the reason."""

    number: int
    message: str


@dataclass
class BlockBuilder:
    """Collector of rows with equal columns, up to the size of a block.

    columns: the columns. readers: parser of each column's cells. index: of the next row.
    """

    columns: Sequence[Column]
    readers: Sequence[Callable[[Sequence[Any]], list[Any]]]
    index: int = 0

    def __post_init__(self) -> None:
        self._numbers: list[int] = []
        self._rows: list[Sequence[Any]] = []

    def add(self, number: int, row: Sequence[Any]) -> bool:
        """Add a row; return whether the block is full."""
        self._numbers.append(number)
        self._rows.append(row)
        return len(self._rows) == BLOCK_SIZE

    def broken(self, row: BrokenRow) -> Iterator[RowBlock | BrokenRow]:
        """Yield the collected block, then a row without cells."""
        yield from self.flush()
        self.index += 1
        yield row

    def flush(self) -> Iterator[RowBlock]:
        """Yield the collected rows as a block, if there are any."""
        numbers, rows = self._numbers, self._rows
        if rows:
            cells = list(zip(*rows, strict=True))
            yield RowBlock(self.index, numbers, self.columns, self.readers, cells)
        self.index += len(rows)
        self._numbers, self._rows = [], []
