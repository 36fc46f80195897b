"""Queries of a Parquet file: columns of numbers and of strings; null says nothing.

Rows are counted from 1. Read batch by batch with pyarrow, which is an extra.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from service.export.blocks import SIZE, Block
from service.export.cells import Flag, Number, Whole
from service.export.columns import Column, Columns
from service.export.originals import Original
from service.motion.errors import FileError


@dataclass(frozen=True)
class ParquetFile:
    """A Parquet file whose columns were understood, and how many rows it has."""

    original: Original
    heading: tuple[Column, ...]
    count: int

    def place(self, row: int) -> str:
        """How a row is named in messages."""
        return f"{self.original.path} row {row}"

    def blocks(self) -> Iterator[Block]:
        """Rows from the first on."""
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
    """A Parquet file; FileError where its columns are not what is needed, or pyarrow is missing."""
    with _opened(original) as file:
        schema, rows = file.schema_arrow, file.metadata.num_rows
    try:
        heading = columns.heading(schema.names)
        for column, kind in zip(heading, schema.types, strict=True):
            _check_type(column, kind)
    except ValueError as fault:
        raise FileError(original.path, str(fault)) from fault
    return ParquetFile(original, heading, rows)


@contextmanager
def _opened(original: Original) -> Iterator[Any]:
    """The file as pyarrow's; whatever pyarrow finds wrong with it is a FileError."""
    try:
        import pyarrow
        import pyarrow.parquet
    except ModuleNotFoundError as fault:
        raise FileError(
            original.path, "needs pyarrow to be read: install posefield[parquet]"
        ) from fault
    try:
        with pyarrow.parquet.ParquetFile(original.path) as file:
            yield file
    except (pyarrow.ArrowException, OSError) as fault:
        raise FileError(original.path, f"cannot be read as Parquet: {fault}") from fault


def _check_type(column: Column, kind: Any) -> None:
    """ValueError for a column of a type that never holds what its cells should."""
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
"""Of pyarrow.types, for kinds that are no strings."""
