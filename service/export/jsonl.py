"""Queries of a JSON Lines file: UTF-8, one object a line.

Its keys are those of a table's heading; controls may stand in an object `controls` instead. Blank
lines are no rows. null says nothing, as does a key that is not there.
"""

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import orjson

from service.export.blocks import Block, Broken, Gathering
from service.export.columns import CONTROL, Columns, shown
from service.export.originals import Original, lines

BOM = b"\xef\xbb\xbf"
HEADINGS = 256
"""Different sets of keys that are remembered: most files have one or a few."""


@dataclass(frozen=True)
class JsonLines:
    """A JSON Lines file; how many rows it has only its end tells."""

    original: Original
    columns: Columns
    count: None = None

    def place(self, line: int) -> str:
        """How a row is named in messages."""
        return f"{self.original.path}:{line}"

    def blocks(self) -> Iterator[Block | Broken]:
        """Rows in columns that are the same for all of them."""
        return self.original.unchanged(self._blocks())

    def _blocks(self) -> Iterator[Block | Broken]:
        all_columns = self.columns.all
        gathering = Gathering(all_columns, [column.kind.values for column in all_columns])
        row = _Rows(self.columns)
        path = self.original.path
        with path.open("rb") as file:
            for number, line in enumerate(lines(path, file.readline), start=1):
                text = line.removeprefix(BOM) if number == 1 else line
                if not text.strip():
                    continue
                try:
                    full = gathering.add(number, row.cells(text))
                except ValueError as fault:
                    yield from gathering.broken(Broken(number, str(fault)))
                    continue
                if full:
                    yield from gathering.flush()
            yield from gathering.flush()


class _Rows:
    """Turns lines into cells of all columns."""

    def __init__(self, columns: Columns) -> None:
        self._width = len(columns.all)
        place = {column: i for i, column in enumerate(columns.all)}
        self._places = lru_cache(HEADINGS)(
            lambda titles: [place[column] for column in columns.heading(titles)]
        )

    def cells(self, line: bytes) -> Sequence[Any]:
        """Cells of a line; ValueError where it is no object, or its keys are no heading."""
        keys, values = _pairs(line)
        cells = [None] * self._width
        for place, value in zip(self._places(keys), values, strict=True):
            cells[place] = value
        return cells


def _pairs(line: bytes) -> tuple[tuple[str, ...], list[Any]]:
    """Keys and values of an object, those of `controls` among them."""
    row = _object(line)
    nested = row.pop("controls", {})
    if not isinstance(nested, dict):
        raise ValueError(f"controls: {shown(nested)}, expected an object")
    keys = (*row, *(CONTROL + name for name in nested))
    return keys, [*row.values(), *nested.values()]


def _object(line: bytes) -> dict[str, Any]:
    try:
        row = orjson.loads(line)
    except orjson.JSONDecodeError as fault:
        raise ValueError(f"not JSON: {fault}") from fault
    if not isinstance(row, dict):
        raise ValueError(f"{shown(row)}, expected an object")
    nested = row.get("controls")
    keys = len(row) + (len(nested) if isinstance(nested, dict) else 0)
    # A key costs a colon: where there are more, one may be in a string, or a key was there twice.
    if line.count(b":") > keys:
        _look_for_twins(line)
    return row


def _look_for_twins(line: bytes) -> None:
    try:
        json.loads(line, object_pairs_hook=_refuse_twins)
    except RecursionError as fault:
        raise ValueError("objects or lists in one another too often") from fault


def _refuse_twins(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    keys = [key for key, _ in pairs]
    twins = sorted({key for key in keys if keys.count(key) > 1})
    if twins:
        raise ValueError(f"{twins[0]!r} twice, expected once")
    return dict(pairs)
