"""Cells of a CSV table, read with errors that name line and column."""

import csv
import io
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice, pairwise

from posefield.common.errors import RecipeError
from posefield_train.source import data_folder
from posefield_train.source.data_folder import FileLocation
from posefield_train.source.recipe_sections.data_sections import Condition

LABEL_FORM = (
    "a name of printable characters, without commas and colons, and without blanks at its ends"
)


FrameSpans = tuple[tuple[int, int], ...]
"""Intervals of frames of a file, first and last."""


def is_label(name: str) -> bool:
    """Return True for a name that requests can give, also within a mixture."""
    marks = "," in name or ":" in name
    return bool(name) and name == name.strip() and name.isprintable() and not marks


MAX_BYTES, MOST_ROWS, MOST_COLUMNS = 16_000_000, 100_000, 1_000
"""Limits of a table: a hundred times the size of the largest published families of motions."""


def _records(place: FileLocation) -> list[tuple[int, dict[str, str]]]:
    try:
        text = data_folder.read(place, MAX_BYTES, "a table").decode("utf-8-sig")
    except UnicodeDecodeError as fault:
        raise RecipeError(str(place), f"not UTF-8 text: {fault}") from fault
    reader = csv.DictReader(io.StringIO(text, newline=None), strict=True)
    try:
        _refuse_columns(place, reader.fieldnames or [])
        records = [(reader.line_num, record) for record in islice(reader, MOST_ROWS)]
        further = next(reader, None)
    except csv.Error as fault:
        raise RecipeError(str(place), f"not CSV: {fault}", reader.line_num) from fault
    if further is not None:
        message = f"found more than {MOST_ROWS} rows, expected at most {MOST_ROWS}"
        raise RecipeError(str(place), message, reader.line_num)
    for line, record in records:
        if None in record or None in record.values():
            columns = len(reader.fieldnames or [])
            raise RecipeError(str(place), f"not the {columns} cells of the heading", line)
    return records


def _refuse_columns(place: FileLocation, names: Sequence[str]) -> None:
    """Raise RecipeError for too many columns, and for two of one name."""
    if len(names) > MOST_COLUMNS:
        message = f"found {len(names)} columns, expected at most {MOST_COLUMNS}"
        raise RecipeError(str(place), message, 1)
    twins = sorted({name for name in names if names.count(name) > 1})
    if twins:
        raise RecipeError(str(place), f"columns {twins} are in the heading twice", 1)


def open_table(place: FileLocation) -> "ClipTable":
    """Return the table of a CSV file; RecipeError if it is invalid."""
    return ClipTable(str(place), _records(place))


@dataclass(frozen=True)
class ClipTable:
    """Cells of a file by line and column; errors name both."""

    name: str
    records: list[tuple[int, dict[str, str]]]

    @property
    def columns(self) -> list[str]:
        """Return the names of the columns, in order."""
        return list(self.records[0][1]) if self.records else []

    def expect_only(self, columns: Collection[str]) -> None:
        """Raise RecipeError for unknown columns."""
        unknown = sorted(set(self.records[0][1]) - set(columns))
        if unknown:
            known = ", ".join(sorted(columns))
            raise RecipeError(self.name, f"columns {unknown}, expected some of {known}", 1)

    def require(self, columns: Mapping[str, str]) -> None:
        """Raise RecipeError for a table without rows, or without a required column.

        columns: explanation of each, for the message.
        """
        if not self.records:
            raise RecipeError(self.name, "no rows below the heading")
        there = self.records[0][1]
        for column, why in columns.items():
            if column not in there:
                raise RecipeError(
                    self.name, f"no column {column!r} ({why}); there are {', '.join(there)}", 1
                )

    def number(self, line: int, record: dict[str, str], column: str) -> float:
        """Return the number in a cell."""
        try:
            # float() accepts 1_000, which is not a number in CSV.
            value = float(record[column].replace("_", "?"))
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            found = record[column]
            raise RecipeError(self.name, f"column {column!r}: {found!r}, expected a number", line)
        return value

    def frame(self, line: int, record: dict[str, str], column: str) -> int:
        """Return the frame index in a cell."""
        value = self.number(line, record, column)
        if value != int(value) or value < 0:
            raise RecipeError(
                self.name, f"column {column!r}: {record[column]!r}, expected a frame from 0", line
            )
        return int(value)

    def spans(self, line: int, record: dict[str, str], column: str) -> FrameSpans:
        """Return the intervals of frames in a cell, such as '12-40 77-90', in order."""
        ends = [part.split("-") for part in record[column].split()]
        right = all(len(pair) == 2 and all(end.isdecimal() for end in pair) for pair in ends)
        flat = [int(end) for pair in ends for end in pair] if right else []
        # A contact begins behind the end of the one before; one frame is an interval, too.
        right = right and all(a <= b for a, b in pairwise(flat))
        right = right and all(b < c for b, c in zip(flat[1::2], flat[2::2], strict=False))
        if not right:
            raise RecipeError(
                self.name,
                f"column {column!r}: {record[column]!r}, expected intervals of frames in order, "
                "such as '12-40 77-90', or nothing",
                line,
            )
        return tuple(zip(flat[::2], flat[1::2], strict=True))

    def name_of(self, line: int, record: dict[str, str], column: str) -> str:
        """Return the name in a cell of labels."""
        found = record[column]
        if not is_label(found):
            raise RecipeError(
                self.name, f"column {column!r}: {found!r}, expected {LABEL_FORM}", line
            )
        return found

    def satisfies(
        self, line: int, record: dict[str, str], column: str, condition: Condition
    ) -> bool:
        """Return True if a cell meets a condition."""
        cell = record[column]
        if condition.among is not None and cell not in condition.among:
            return False
        if condition.without is not None and cell in condition.without:
            return False
        if condition.minimum is None and condition.maximum is None:
            return True
        low = -math.inf if condition.minimum is None else condition.minimum
        high = math.inf if condition.maximum is None else condition.maximum
        return low <= self.number(line, record, column) <= high
