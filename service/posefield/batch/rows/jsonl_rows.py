"""Queries of a JSON Lines file: UTF-8, one object a line.

The keys are those of a table's heading; controls may be in an object `controls` instead. Blank
lines are ignored. null equals a missing key.
"""

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import orjson

from posefield.batch.rows.columns import CONTROL_PREFIX, Columns, shortened_text
from posefield.batch.rows.row_blocks import BlockBuilder, BrokenRow, RowBlock
from posefield.batch.rows.source_files import SourceFile, read_lines

BOM = b"\xef\xbb\xbf"
MAX_CACHED_HEADINGS = 256
"""Number of cached sets of keys: most files have one or a few."""


@dataclass(frozen=True)
class JsonLinesFile:
    """A JSON Lines file as a source of rows."""

    source_file: SourceFile
    columns: Columns

    def place(self, line: int) -> str:
        """Return the name of a row for messages."""
        return f"{self.source_file.path}:{line}"

    def blocks(self) -> Iterator[RowBlock | BrokenRow]:
        """Yield blocks of rows, all with the same columns."""
        return self.source_file.unchanged(self._blocks())

    def _blocks(self) -> Iterator[RowBlock | BrokenRow]:
        all_columns = self.columns.all
        gathering = BlockBuilder(all_columns, [column.kind.values for column in all_columns])
        row = _LineParser(self.columns)
        path = self.source_file.path
        with path.open("rb") as file:
            for number, line in enumerate(read_lines(path, file.readline), start=1):
                text = line.removeprefix(BOM) if number == 1 else line
                if not text.strip():
                    continue
                try:
                    full = gathering.add(number, row.cells(text))
                except ValueError as fault:
                    yield from gathering.broken(BrokenRow(number, str(fault)))
                    continue
                if full:
                    yield from gathering.flush()
            yield from gathering.flush()


class _LineParser:
    """Parser of lines to cells of all columns."""

    def __init__(self, columns: Columns) -> None:
        self._width = len(columns.all)
        place = {column: i for i, column in enumerate(columns.all)}
        self._places = lru_cache(MAX_CACHED_HEADINGS)(
            lambda titles: [place[column] for column in columns.heading(titles)]
        )

    def cells(self, line: bytes) -> Sequence[Any]:
        """Return the cells of a line; ValueError if it is not an object or has invalid keys."""
        keys, values = _pairs(line)
        cells = [None] * self._width
        for place, value in zip(self._places(keys), values, strict=True):
            cells[place] = value
        return cells


def _pairs(line: bytes) -> tuple[tuple[str, ...], list[Any]]:
    """Return keys and values of an object, including those of `controls`."""
    row = _object(line)
    nested = row.pop("controls", {})
    if not isinstance(nested, dict):
        raise ValueError(f"controls: {shortened_text(nested)}, expected an object")
    keys = (*row, *(CONTROL_PREFIX + name for name in nested))
    return keys, [*row.values(), *nested.values()]


def _object(line: bytes) -> dict[str, Any]:
    try:
        row = orjson.loads(line)
    except orjson.JSONDecodeError as fault:
        raise ValueError(f"not JSON: {fault}") from fault
    if not isinstance(row, dict):
        raise ValueError(f"{shortened_text(row)}, expected an object")
    nested = row.get("controls")
    keys = len(row) + (len(nested) if isinstance(nested, dict) else 0)
    # A key takes one colon: if there are more, a string contains one or a key is repeated.
    if line.count(b":") > keys:
        _check_duplicate_keys(line)
    return row


def _check_duplicate_keys(line: bytes) -> None:
    try:
        json.loads(line, object_pairs_hook=_refuse_duplicate_keys)
    except RecursionError as fault:
        raise ValueError("objects or lists in one another too often") from fault


def _refuse_duplicate_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    keys = [key for key, _ in pairs]
    twins = sorted({key for key in keys if keys.count(key) > 1})
    if twins:
        raise ValueError(f"{twins[0]!r} twice, expected once")
    return dict(pairs)
