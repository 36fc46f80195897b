"""Queries of a CSV file: UTF-8, with a heading, comma-separated and quoted where necessary.

Blank lines are ignored. An empty cell has no value. A row is named by its first line.
"""

import csv
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

from posefield.batch.rows.columns import Column, Columns
from posefield.batch.rows.row_blocks import BlockBuilder, BrokenRow, RowBlock
from posefield.batch.rows.source_files import SourceFile, read_lines
from posefield.common.errors import FileError


@dataclass(frozen=True)
class CsvFile:
    """A CSV file with a valid heading, as a source of rows."""

    source_file: SourceFile
    heading: tuple[Column, ...]

    def place(self, line: int) -> str:
        """Return the name of a row for messages."""
        return f"{self.source_file.path}:{line}"

    def blocks(self) -> Iterator[RowBlock | BrokenRow]:
        """Yield the rows below the heading, in blocks."""
        return self.source_file.unchanged(self._blocks())

    def _blocks(self) -> Iterator[RowBlock | BrokenRow]:
        gathering = BlockBuilder(self.heading, [column.kind.text for column in self.heading])
        with _open(self.source_file.path) as file:
            rows = _rows(self.source_file.path, file)
            next(rows)
            for row in rows:
                if isinstance(row, BrokenRow):
                    yield from gathering.broken(row)
                elif len(row[1]) != len(self.heading):
                    message = f"{len(row[1])} cells, expected {len(self.heading)} as in the heading"
                    yield from gathering.broken(BrokenRow(row[0], message))
                elif gathering.add(*row):
                    yield from gathering.flush()
            yield from gathering.flush()


def read(original: SourceFile, columns: Columns) -> CsvFile:
    """Return a CSV file; FileError if its heading does not fit the model."""
    with _open(original.path) as file:
        first = next(_rows(original.path, file), BrokenRow(1, "empty, expected a heading"))
    if isinstance(first, BrokenRow):
        raise FileError(original.path, first.message, first.number)
    line, titles = first
    try:
        return CsvFile(original, columns.heading([_stripped_title(title) for title in titles]))
    except ValueError as fault:
        separator = ", and commas between columns" if ";" in titles[0] else ""
        raise FileError(original.path, f"{fault}{separator}", line) from fault


def _open(path: Path) -> TextIO:
    # Bytes that are not UTF-8 become surrogates, so that a fault names their line.
    return path.open(encoding="utf-8-sig", errors="surrogateescape", newline="")


def _rows(path: Path, file: TextIO) -> Iterator[tuple[int, list[str]] | BrokenRow]:
    """Yield line number and cells of each row, without blank ones."""
    reader = csv.reader(read_lines(path, file.readline), strict=True, skipinitialspace=True)
    while True:
        line = reader.line_num + 1
        try:
            row = next(reader)
        except StopIteration:
            return
        except csv.Error as fault:
            yield BrokenRow(line, f"not CSV: {fault}")
        else:
            if row:
                yield line, row


def _stripped_title(title: str) -> str:
    if not title.isprintable():
        raise ValueError(f"{title!r} in the heading, expected text in UTF-8")
    return title.strip()
