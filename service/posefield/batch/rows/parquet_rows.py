"""Queries of a Parquet file: columns of numbers and strings, null for an empty cell.

Rows are counted from 1. The file is read in batches by pyarrow, an optional extra.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from posefield.batch.rows.cells import Flag, Number, Whole
from posefield.batch.rows.columns import Column, Columns
from posefield.batch.rows.row_blocks import SIZE, Block
from posefield.batch.rows.source_files import Original
from posefield.common.errors import FileError


@dataclass(frozen=True)
class ParquetFile:
    """A Parquet file with valid columns, as a source of rows."""

    original: Original
    heading: tuple[Column, ...]

    def place(self, row: int) -> str:
        """Return the name of a row for messages."""
        return f"{self.original.path} row {row}"

    def blocks(self) -> Iterator[Block]:
        """Yield the rows in blocks, in order."""
        return self.original.unchanged(self._blocks())

    def _blocks(self) -> Iterator[Block]:
        readers = [column.kind.values for column in self.heading]
        first = 0
        with _opened(self.original) as file:
            for batch in file.iter_batches(SIZE):
                size = len(batch)
                cells = [column.to_pylist() for column in batch.columns]
                numbers = range(first + 1, first + size + 1)
                if size:
                    yield Block(first, numbers, self.heading, readers, cells)
                first += size


def read(original: Original, columns: Columns) -> ParquetFile:
    """Return a Parquet file.

    Raises FileError if its columns do not fit the model or pyarrow is missing.
    """
    with _opened(original) as file:
        schema = file.schema_arrow
    try:
        heading = columns.heading(schema.names)
        for column, kind in zip(heading, schema.types, strict=True):
            _check_type(column, kind)
    except ValueError as fault:
        raise FileError(original.path, str(fault)) from fault
    return ParquetFile(original, heading)


@contextmanager
def _opened(original: Original) -> Iterator[Any]:
    """Open the file with pyarrow; convert pyarrow's errors to FileError."""
    try:
        import pyarrow
        import pyarrow.parquet
    except ModuleNotFoundError as fault:
        raise FileError(
            original.path, 'needs pyarrow to be read: pip install "posefield[parquet]"'
        ) from fault
    try:
        with pyarrow.parquet.ParquetFile(original.path) as file:
            yield file
    except (pyarrow.ArrowException, OSError) as fault:
        raise FileError(original.path, f"cannot be read as Parquet: {fault}") from fault


def _check_type(column: Column, kind: Any) -> None:
    """Raise ValueError for a column with a type that does not fit its cells."""
    import pyarrow

    types = pyarrow.types
    plain = kind.value_type if types.is_dictionary(kind) else kind
    tests = _TESTS.get(type(column.kind), ("is_string", "is_large_string"))
    if not any(getattr(types, test)(plain) for test in (*tests, "is_null")):
        raise ValueError(f"column {column.name!r} of type {kind}, expected {column.kind.expected}")


_TESTS = {
    Number: ("is_floating", "is_integer"),
    Whole: ("is_floating", "is_integer"),
    Flag: ("is_boolean",),
}
"""Functions of pyarrow.types by kind, for all kinds except strings."""
