"""Tables of queries: their columns, and the cells of CSV, JSON Lines and Parquet files.

A table has a column for each control and label set of the model, by its name, and those of
OPTION_COLUMNS; none is required. A heading may state the unit of a control, `speed [m/s]` or
`speed (m/s)`, which must be the model's. `controls/NAME` and `labels/NAME` are accepted, too.
"""

import csv
import hashlib
import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from itertools import chain
from pathlib import Path
from typing import Any, AnyStr, TextIO

from posefield.common.errors import FileError, FormError, QueryError, similar_name
from posefield.model_file.model_card import PERFORMER, ModelCard
from posefield.question import text_decoding
from posefield.question.motion_question import NamedClipQuestion
from posefield.question.text_decoding import Parameter

MAX_LINE_LENGTH = 1 << 20
"""Characters of the longest line: a file without line ends is not a table and might not fit into
memory.
"""
MAX_TEXT_LENGTH = 200
"""Characters of the longest value that a message repeats."""
PARQUET_ROWS = 4096
"""Rows of a Parquet file in memory."""
WITH_UNIT = re.compile(r"(?P<name>.*?)\s*(\[(?P<square>[^\]]*)\]|\((?P<round>[^)]*)\))")
TABLE_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?", re.ASCII)
"""Numbers as tables write them; a URL has no +1, 1. and .5."""
BOM = b"\xef\xbb\xbf"


@dataclass(frozen=True)
class Column:
    """A column of a table.

    name: of a control, a label set or a field of a question. group: "controls", "labels" or "".
    unit: that its heading may state. parameter: text parameter of the field; None in a group.
    """

    name: str
    group: str = ""
    unit: str | None = None
    parameter: Parameter | None = None

    @cached_property
    def field(self) -> str:
        """Field of a question."""
        return self.group or self.name

    @cached_property
    def numeric(self) -> bool:
        """Return whether its cells are numbers."""
        kind = self.parameter.kind if self.parameter else None
        return self.group == "controls" or kind in (int, float)

    def texts(self, cell: str) -> list[tuple[str, str]]:
        """Return names and texts of the parameters that a URL has for a cell of text."""
        if self.numeric:
            return [(self.name, self._number(cell))]
        if self.parameter is None:
            return [("label", f"{self.name}={cell}")]
        word, kind = self.parameter.word, self.parameter.kind
        if self.parameter.repeated:
            return [(word, item.strip()) for item in cell.split(";")]
        return [(word, cell.lower() if kind is bool else cell)]

    def _number(self, cell: str) -> str:
        """Return a number as in a URL; columns of whole numbers with gaps have floats."""
        is_integer = self.parameter is not None and self.parameter.kind is int
        if not is_integer and text_decoding.NUMBER.fullmatch(cell):
            return cell
        if not TABLE_NUMBER.fullmatch(cell.strip()):
            return cell
        number = float(cell)
        return str(int(number)) if is_integer and number.is_integer() else repr(number)


Columns = Mapping[str, Column]
"""Columns by each of their titles."""
RawRow = tuple[str, Iterable[tuple[Column, Any]] | QueryError]
"""Place of a row, and its cells or the reason why it has none."""
RawRows = Callable[[], Iterator[RawRow]]
"""Begins a new pass through the rows of a source."""

OPTION_COLUMNS: Columns = {
    "format": Column("format"),
    **{
        parameter.field: Column(parameter.field, unit=parameter.unit, parameter=parameter)
        for parameter in text_decoding.parameters(NamedClipQuestion).values()
        # Each label set has a column.
        if parameter.field not in ("joint_sigma", "labels")
    },
}
"""Columns of any model: the format, and the fields of a NamedClipQuestion."""


def table_columns(card: ModelCard) -> Columns:
    """Return the columns of tables for a model: its controls and label sets, and the options."""
    controls = [Column(control.name, "controls", control.unit) for control in card.controls]
    labels = [
        Column(label_set.name, "labels") for label_set in card.labels if label_set.name != PERFORMER
    ]
    grouped = (*controls, *labels)
    prefixed = {f"{column.group}/{column.name}": column for column in grouped}
    return {**{column.name: column for column in grouped}, **OPTION_COLUMNS, **prefixed}


def read_heading(columns: Columns, titles: Sequence[str]) -> tuple[Column, ...]:
    """Return the columns of titles; ValueError for one that is unknown or there twice."""
    heading = tuple(find_column(columns, title) for title in titles)
    for index, column in enumerate(heading):
        if column in heading[:index]:
            raise ValueError(f"column {column.name!r} twice, expected once")
    return heading


def find_column(columns: Columns, title: str) -> Column:
    """Return the column of a title; ValueError if it is unknown or states another unit."""
    if title in columns:
        return columns[title]
    stated = WITH_UNIT.fullmatch(title)
    column = columns.get(stated["name"]) if stated else None
    if not stated or not column:
        titles = [name for name in columns if "/" not in name]
        near = similar_name(title, titles)
        hint = f"did you mean {near!r}?" if near else f"expected one of {', '.join(titles)}"
        raise ValueError(f"unknown column {shortened_text(title)}, {hint}")
    unit = stated["square"] or stated["round"] or ""
    if unit.strip() != column.unit:
        expected = column.unit or "none"
        raise ValueError(f"column {column.name!r} in the unit {unit!r}, expected {expected}")
    return column


def shortened_text(value: object) -> str:
    """Return a value as text for messages, of MAX_TEXT_LENGTH characters at most."""
    text = repr(value)
    return text if len(text) <= MAX_TEXT_LENGTH else f"{text[:MAX_TEXT_LENGTH]}..."


@dataclass(frozen=True)
class TableFile:
    """Rows of a file that is read anew at each pass, and must not change in between.

    stamp: size, bytes, and modification time, ns, at the first reading. digest: SHA-256.
    """

    path: Path
    stamp: tuple[int, int]
    digest: str
    read: RawRows

    def rows(self) -> Iterator[RawRow]:
        """Yield the rows; FileError before the first one after a change."""
        for row in self.read():
            self._check_unchanged()
            yield row
        self._check_unchanged()

    def _check_unchanged(self) -> None:
        if _stamp(self.path) != self.stamp:
            raise FileError(self.path, "changed while it was used, expected what was first read")


def open_table(path: Path, columns: Columns) -> TableFile:
    """Return the rows of a file whose ending is in TABLES.

    Raises FileError if it cannot be read, or its heading has other columns.
    """
    if path.exists() and not path.is_file():
        raise FileError(path, "not a file, expected one: it is read more than once")
    stamp = _stamp(path)
    try:
        with path.open("rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as fault:
        raise FileError(path, f"cannot be read: {fault.strerror}") from fault
    return TableFile(path, stamp, digest, TABLES[path.suffix.lower()](path, columns))


def _stamp(path: Path) -> tuple[int, int]:
    try:
        status = path.stat()
    except OSError as fault:
        raise FileError(path, f"cannot be read: {fault.strerror}") from fault
    return status.st_size, status.st_mtime_ns


def read_rows(path: Path, readline: Callable[[int], AnyStr]) -> Iterator[AnyStr]:
    """Yield the lines of an open file; FileError for a line that is too long."""
    for number, line in enumerate(iter(partial(readline, MAX_LINE_LENGTH), readline(0)), start=1):
        if len(line) == MAX_LINE_LENGTH:
            problem = f"a line of {MAX_LINE_LENGTH} characters or more"
            raise FileError(path, f"{problem}, expected one row a line", number)
        yield line


def _csv_table(path: Path, columns: Columns) -> RawRows:
    """Return the rows of a CSV file: UTF-8, with a heading; an empty cell has no value."""
    with _open_csv(path) as file:
        line, titles = next(_csv_cells(path, file), (1, FormError("", "empty, expected a heading")))
    if isinstance(titles, QueryError):
        raise FileError(path, titles.message, line)
    try:
        for title in titles:
            if not title.isprintable():
                raise ValueError(f"{title!r} in the heading, expected text in UTF-8")
        heading = read_heading(columns, [title.strip() for title in titles])
    except ValueError as fault:
        separator = ", and commas between columns" if ";" in titles[0] else ""
        raise FileError(path, f"{fault}{separator}", line) from fault
    return partial(_csv_rows, path, heading)


def _csv_rows(path: Path, heading: Sequence[Column]) -> Iterator[RawRow]:
    with _open_csv(path) as file:
        rows = _csv_cells(path, file)
        next(rows)
        for line, cells in rows:
            if isinstance(cells, QueryError):
                yield f"{path}:{line}", cells
            elif len(cells) != len(heading):
                problem = f"{len(cells)} cells, expected {len(heading)} as in the heading"
                yield f"{path}:{line}", FormError("", problem)
            else:
                yield (
                    f"{path}:{line}",
                    [pair for pair in zip(heading, cells, strict=True) if pair[1]],
                )


def _open_csv(path: Path) -> TextIO:
    # Bytes that are not UTF-8 become surrogates, so that a fault names their line.
    return path.open(encoding="utf-8-sig", errors="surrogateescape", newline="")


def _csv_cells(path: Path, file: TextIO) -> Iterator[tuple[int, list[str] | QueryError]]:
    """Yield the first line and the cells of each row that is not blank."""
    reader = csv.reader(read_rows(path, file.readline), strict=True, skipinitialspace=True)
    while True:
        line = reader.line_num + 1
        try:
            row = next(reader)
        except StopIteration:
            return
        except csv.Error as fault:
            yield line, FormError("", f"not CSV: {fault}")
        else:
            if row:
                yield line, row


def _json_lines(path: Path, columns: Columns) -> RawRows:
    """Return the rows of a JSON Lines file: UTF-8, one object a line, blank lines ignored.

    The keys are those of a table's heading; controls may be in an object `controls` instead. null
    equals a missing key.
    """
    heading = lru_cache(partial(read_heading, columns))

    def rows() -> Iterator[RawRow]:
        with path.open("rb") as file:
            for number, line in enumerate(read_rows(path, file.readline), start=1):
                text = line.removeprefix(BOM) if number == 1 else line
                if not text.strip():
                    continue
                location = f"{path}:{number}"
                try:
                    row = _json_object(text)
                    pairs = zip(heading(tuple(row)), row.values(), strict=True)
                    yield location, [pair for pair in pairs if pair[1] is not None]
                except ValueError as fault:
                    yield location, FormError("", str(fault))

    return rows


def _json_object(line: bytes) -> dict[str, Any]:
    """Return the object of a line, with the members of `controls` beside its others.

    Raises ValueError for any other text, and for a key that is there twice.
    """
    try:
        row = json.loads(line, object_pairs_hook=_unique_keys)
    except (json.JSONDecodeError, UnicodeDecodeError) as fault:
        raise ValueError(f"not JSON: {fault}") from fault
    except RecursionError as fault:
        raise ValueError("objects or lists in one another too often") from fault
    if not isinstance(row, dict):
        raise ValueError(f"{shortened_text(row)}, expected an object")
    controls = row.pop("controls", {})
    if not isinstance(controls, dict):
        raise ValueError(f"controls: {shortened_text(controls)}, expected an object")
    return row | {f"controls/{name}": value for name, value in controls.items()}


def _unique_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    row = dict(pairs)
    if len(row) < len(pairs):
        keys = [key for key, _ in pairs]
        twin = next(key for index, key in enumerate(keys) if key in keys[:index])
        raise ValueError(f"{twin!r} twice, expected once")
    return row


def _parquet_table(path: Path, columns: Columns) -> RawRows:
    """Return the rows of a Parquet file, counted from 1; null equals an empty cell."""
    try:
        import pyarrow
        import pyarrow.parquet
    except ModuleNotFoundError as fault:
        needed = 'needs pyarrow to be read: pip install "posefield[parquet]"'
        raise FileError(path, needed) from fault

    @contextmanager
    def opened() -> Iterator[tuple[Any, tuple[Column, ...]]]:
        try:
            with pyarrow.parquet.ParquetFile(path) as file:
                yield file, read_heading(columns, file.schema_arrow.names)
        except (pyarrow.ArrowException, OSError) as fault:
            raise FileError(path, f"cannot be read as Parquet: {fault}") from fault
        except ValueError as fault:
            raise FileError(path, str(fault)) from fault

    def rows() -> Iterator[RawRow]:
        with opened() as (file, heading):
            batches = file.iter_batches(PARQUET_ROWS)
            cells = (zip(*map(list, b.to_pydict().values()), strict=True) for b in batches)
            for number, row in enumerate(chain.from_iterable(cells), start=1):
                pairs = zip(heading, row, strict=True)
                yield f"{path} row {number}", [pair for pair in pairs if pair[1] is not None]

    with opened():
        return rows


TABLES: Mapping[str, Callable[[Path, Columns], RawRows]] = {
    ".csv": _csv_table,
    ".jsonl": _json_lines,
    ".ndjson": _json_lines,
    ".parquet": _parquet_table,
}
"""Readers of tables by the ending of their files."""
