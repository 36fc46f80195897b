"""Queries of a Parquet file: columns of numbers and strings, null for an empty cell.

Rows are counted from 1. The file is read in batches by pyarrow, an optional extra.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from posefield.batch.rows.cells import BooleanCell, FloorCell, IntegerCell, NumberCell
from posefield.batch.rows.columns import Column, Columns
from posefield.batch.rows.row_blocks import BLOCK_SIZE, RowBlock
from posefield.batch.rows.source_files import SourceFile
from posefield.common.errors import FileError


@dataclass(frozen=True)
class ParquetFile:
    """A Parquet file with valid columns, as a source of rows."""

    source_file: SourceFile
    heading: tuple[Column, ...]

    def place(self, row: int) -> str:
        """Return the name of a row for messages."""
        return f"{self.source_file.path} row {row}"

    def blocks(self) -> Iterator[RowBlock]:
        """Yield the rows in blocks, in order."""
        return self.source_file.unchanged(self._blocks())

    def _blocks(self) -> Iterator[RowBlock]:
        readers = [column.kind.values for column in self.heading]
        first = 0
        with _opened(self.source_file) as file:
            for batch in file.iter_batches(BLOCK_SIZE):
                size = len(batch)
                cells = [column.to_pylist() for column in batch.columns]
                numbers = range(first + 1, first + size + 1)
                if size:
                    yield RowBlock(first, numbers, self.heading, readers, cells)
                first += size


def read(original: SourceFile, columns: Columns) -> ParquetFile:
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
def _opened(original: SourceFile) -> Iterator[Any]:
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
    tests = _TYPE_TESTS.get(type(column.kind), ("is_string", "is_large_string"))
    if not any(getattr(types, test)(plain) for test in (*tests, "is_null")):
        raise ValueError(f"column {column.name!r} of type {kind}, expected {column.kind.expected}")


_TYPE_TESTS = {
    NumberCell: ("is_floating", "is_integer"),
    IntegerCell: ("is_floating", "is_integer"),
    BooleanCell: ("is_boolean",),
    FloorCell: ("is_floating", "is_integer", "is_string", "is_large_string"),
}
"""Functions of pyarrow.types by kind, for all kinds that are not strings alone."""
