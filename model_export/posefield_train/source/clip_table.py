"""Table of clips: cells of a CSV file, with errors that name line and column, one row per clip."""

import csv
import io
import math
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice, pairwise
from pathlib import Path

import numpy as np

from posefield.common.errors import RecipeError
from posefield.common.units import Floats
from posefield_train.source import data_folder
from posefield_train.source.bvh_hierarchy import foreign_encoding
from posefield_train.source.data_folder import FileLocation
from posefield_train.source.recipe import Recipe
from posefield_train.source.recipe_sections import PERFORMER, Condition

LABEL_FORM = (
    "a name of printable characters, without commas and colons, and without blanks at its ends"
)


STYLE_COLUMNS = ("style", "styles", "emotion", "mood")
"""Columns whose names say that clips of equal controls differ."""

FrameSpans = tuple[tuple[int, int], ...]
"""Intervals of frames of a file, first and last."""


def is_label(name: str) -> bool:
    """Return True for a name that requests can give, also within a mixture."""
    marks = "," in name or ":" in name
    return bool(name) and name == name.strip() and name.isprintable() and not marks


MAX_BYTES, MOST_ROWS, MOST_COLUMNS = 16_000_000, 100_000, 1_000
"""Limits of a table: a hundred times the size of the largest published families of motions."""


DECIMAL_COMMA = re.compile(r"([+-]?\d*),(\d+(?:[eE][+-]?\d+)?)", re.ASCII)


def open_table(file: FileLocation) -> "ClipTable":
    """Return the table of a CSV file; RecipeError if it is invalid.

    Cells are separated by commas, or by semicolons or tabs, of which the heading has more; decimal
    commas are then read as points, and `decimal_commas` counts them.
    """
    content = data_folder.read(file, MAX_BYTES, "a table")
    if packed := foreign_encoding(content[:4]):
        raise RecipeError(str(file), f"found {packed}, expected a table in UTF-8", 1)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as fault:
        raise RecipeError(str(file), f"not UTF-8 text: {fault}") from fault
    content_lines = io.StringIO(text, newline=None)
    heading = content_lines.readline()
    # The first line of a table of Excel may name the separator.
    skipped = int(re.fullmatch("sep=.\n", heading) is not None)
    content_lines.seek(len(heading) if skipped else 0)
    delimiter = heading[4] if skipped else max(",;\t", key=heading.count)
    reader = csv.DictReader(content_lines, strict=True, delimiter=delimiter)
    try:
        names = reader.fieldnames or []
        if len(names) > MOST_COLUMNS:
            message = f"found {len(names)} columns, expected at most {MOST_COLUMNS}"
            raise RecipeError(str(file), message, 1)
        if twins := sorted({name for name in names if names.count(name) > 1}):
            raise RecipeError(str(file), f"columns {twins} are in the heading twice", 1)
        records = [(reader.line_num + skipped, cells) for cells in islice(reader, MOST_ROWS)]
        further = next(reader, None)
    except csv.Error as fault:
        raise RecipeError(str(file), f"not CSV: {fault}", reader.line_num) from fault
    if further is not None:
        message = f"found more than {MOST_ROWS} rows, expected at most {MOST_ROWS}"
        raise RecipeError(str(file), message, reader.line_num)
    for line, record in records:
        if None in record or None in record.values():
            count = sum(record.get(name) is not None for name in names) + len(record.get(None, ""))
            message = f"found {count} cells, expected the {len(names)} of the heading"
            raise RecipeError(str(file), message, line)
    if delimiter == ",":
        return ClipTable(str(file), records)
    commas = sum(bool(DECIMAL_COMMA.fullmatch(c)) for _, cells in records for c in cells.values())
    points = [
        (
            line,
            {
                name: DECIMAL_COMMA.sub(r"\1.\2", c) if DECIMAL_COMMA.fullmatch(c) else c
                for name, c in cells.items()
            },
        )
        for line, cells in records
    ]
    return ClipTable(str(file), points, commas)


def csv_text(rows: Iterable[Sequence[object]]) -> str:
    """Return rows as CSV with Unix line ends."""
    text = io.StringIO(newline="")
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


@dataclass(frozen=True)
class ClipTable:
    """Cells of a file by line and column; errors name both."""

    name: str
    records: list[tuple[int, dict[str, str]]]
    decimal_commas: int = 0

    @property
    def columns(self) -> list[str]:
        """Return the names of the columns, in order."""
        return list(self.records[0][1]) if self.records else []

    def expect_only(self, columns: Collection[str]) -> None:
        """Raise RecipeError for unknown columns."""
        unknown = sorted(set(self.records[0][1]) - set(columns))
        if unknown:
            allowed = ", ".join(sorted(columns))
            raise RecipeError(self.name, f"columns {unknown}, expected some of {allowed}", 1)

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
            cell = record[column]
            expected = "a number with a decimal point" if "," in cell else "a number"
            raise RecipeError(self.name, f"column {column!r}: {cell!r}, expected {expected}", line)
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
        pairs = [word.split("-") for word in record[column].split()]
        right = all(len(pair) == 2 and all(end.isdecimal() for end in pair) for pair in pairs)
        flat = [int(end) for pair in pairs for end in pair] if right else []
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
        name = record[column]
        if not is_label(name):
            raise RecipeError(
                self.name, f"column {column!r}: {name!r}, expected {LABEL_FORM}", line
            )
        return name

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


@dataclass(frozen=True)
class ClipRow:
    """One clip: its file, frames, and controls.

    line: in the table, for messages; None without table. first_frame, last_frame: indices in the
    file from 0, last_frame inclusive; None is the end of the file. controls: those of the table.
    landmarks: frames of the file. other_labels: name of the clip in each further label set.
    recording: name of the recording, unique among the performer's; None if the table has no such
    column. curve_place: file of the clip's curves; None without them, and where the clip has curves
    alone. contacts: first and last frame in the file of each contact, by column. animation: name of
    one of several in the file; None for the only one.
    """

    file: FileLocation
    table: str
    line: int | None
    performer: str
    first_frame: int
    last_frame: int | None
    controls: Floats
    landmarks: tuple[int, ...]
    recording: str | None = None
    other_labels: Mapping[str, str] = field(default_factory=dict)

    curve_place: FileLocation | None = None
    contacts: Mapping[str, FrameSpans] = field(default_factory=dict)
    animation: str | None = None

    @property
    def motion(self) -> str:
        """Return the name of the motion that the clip is a part of: its file and animation."""
        return str(self.file) if self.animation is None else f"{self.file}[{self.animation}]"

    @property
    def labels(self) -> dict[str, str]:
        """Return the name of the clip in each label set, the performer's included."""
        return {PERFORMER: self.performer, **self.other_labels}

    @property
    def curve_file(self) -> FileLocation:
        """Return the file of the clip's curves."""
        return self.curve_place or self.file

    @property
    def named(self) -> str:
        """Return the name of the row in messages: its line and its file."""
        return self.file.name if self.line is None else f"line {self.line}, {self.file.name}"

    @property
    def source(self) -> str:
        """Return the file's name, with frames if the clip is a part of it."""
        if self.first_frame == 0 and self.last_frame is None:
            return self._motion_name
        last = "the end" if self.last_frame is None else self.last_frame
        return f"{self._motion_name}, frames {self.first_frame} to {last}"

    @property
    def _motion_name(self) -> str:
        return self.file.name if self.animation is None else f"{self.file.name}[{self.animation}]"

    def error(self, message: str) -> RecipeError:
        """Return an error that names this row."""
        return RecipeError(self.table, message, self.line)


def read(recipe: Recipe, folder: Path, notes: list[str] | None = None) -> list[ClipRow]:
    """Return the rows of the recipe's table that meet its conditions.

    If the folder lacks the table, the one beside the recipe is read, else the shipped one of its
    name, if there is one. notes: to which those on the table are added. Raises RecipeError, naming
    line and column, for the first invalid cell, and for a missing column, no matching row, two rows
    of the same frames, and styles of which the recipe says nothing.
    """
    file = data_folder.find_table(folder, recipe.clips.table, recipe.folder)
    cells = open_table(file)
    columns = _columns(recipe)
    cells.require(columns)
    chosen = [
        (line, record)
        for line, record in cells.records
        if all(cells.satisfies(line, record, c, w) for c, w in recipe.clips.where.items())
    ]
    rows = [_row(recipe, folder, cells, line, record) for line, record in chosen]
    if not rows:
        raise RecipeError(cells.name, f"none of {len(cells.records)} rows meets the conditions")
    refuse_repeats(rows)
    for name in cells.columns:
        values = {record[name] for _, record in chosen}
        if name.lower() in STYLE_COLUMNS and name not in columns and len(values) > 1:
            raise RecipeError(
                cells.name,
                f"column {name!r} has {len(values)} values and no use in the recipe, expected "
                f"clips.labels = {{ style = {name!r} }} with kriging.label = 'style', or one of "
                "them chosen by clips.where",
                1,
            )
    if notes is not None:
        notes += recipe.notes
        notes += data_folder.table_notes(cells.name)
        if cells.decimal_commas:
            notes.append(f"{file.name}: {cells.decimal_commas} decimal commas were read as points")
    return rows


def _columns(recipe: Recipe) -> dict[str, str]:
    clips = recipe.clips
    purposes = {
        clips.file: "clips.file",
        **dict.fromkeys(clips.where, "clips.where"),
        **dict.fromkeys(clips.landmarks, "clips.landmarks"),
        **{column: f"clips.labels.{name}" for name, column in clips.labels.items()},
        **{control.column: f"control {control.name}" for control in recipe.column_controls},
    }
    purposes |= {column: f"contacts.columns.{j}" for j, column in recipe.contacts.columns.items()}
    for key in ("animation", "performer", "recording", "first_frame", "last_frame"):
        column = getattr(clips, key)
        if column is not None:
            purposes[column] = f"clips.{key}"
    if recipe.curves and recipe.curves.column:
        purposes[recipe.curves.column] = "curves.column"
    return purposes


def _row(
    recipe: Recipe, folder: Path, cells: ClipTable, line: int, record: dict[str, str]
) -> ClipRow:
    clips = recipe.clips
    first = cells.frame(line, record, clips.first_frame) if clips.first_frame else 0
    last = cells.frame(line, record, clips.last_frame) if clips.last_frame else None
    if last is not None and last <= first:
        raise RecipeError(cells.name, f"frames {first} to {last}, expected at least two", line)

    def find(column: str, cell: str) -> FileLocation:
        """Return the file that a cell names; RecipeError names the column."""
        folder_name = clips.table.rpartition("/")[0]
        try:
            return data_folder.find(folder, f"{folder_name}/{cell}" if folder_name else cell)
        except RecipeError as fault:
            text = f"column {column!r}: {fault.message}"
            raise RecipeError(cells.name, text, line) from fault

    motion_file = find(clips.file, record[clips.file])
    performer = record[clips.performer] if clips.performer else ""
    if clips.performer and PERFORMER in recipe.kriging.label:
        # A label of that set makes the performer a name of requests.
        performer = cells.name_of(line, record, clips.performer)
    controls = np.array([cells.number(line, record, c.column) for c in recipe.column_controls])
    landmarks = tuple(cells.frame(line, record, column) for column in clips.landmarks)
    labels = {name: cells.name_of(line, record, column) for name, column in clips.labels.items()}
    recording = record[clips.recording].strip() if clips.recording else None
    if recording == "":
        message = f"column {clips.recording!r}: nothing, expected the name of a recording"
        raise RecipeError(cells.name, message, line)
    curves = recipe.curves
    curve_place = None
    if curves and curves.column and not curves.alone:
        curve_place = find(curves.column, record[curves.column])
    elif curves and not curves.alone:
        # Beside the motion file.
        folder_name, slash, name = record[clips.file].rpartition("/")
        stem = name.rpartition(".")[0] or name
        curve_place = find(clips.file, f"{folder_name}{slash}{stem}{curves.suffix}")
    return ClipRow(
        file=motion_file,
        table=cells.name,
        line=line,
        performer=performer,
        first_frame=first,
        last_frame=last,
        controls=controls,
        landmarks=landmarks,
        other_labels=labels,
        recording=recording,
        curve_place=curve_place,
        contacts={
            column: cells.spans(line, record, column) for column in recipe.contacts.columns.values()
        },
        animation=(record[clips.animation].strip() or None) if clips.animation else None,
    )


def refuse_repeats(rows: Sequence[ClipRow]) -> None:
    """Raise RecipeError for two rows with the same frames of the same file."""
    first_rows: dict[tuple[str, int, int | None], ClipRow] = {}
    for row in rows:
        key = (row.motion, row.first_frame, row.last_frame)
        if key in first_rows:
            line = first_rows[key].line
            again = "as before" if line is None else f"as line {line}"
            raise row.error(f"the same frames of the same file {again}")
        first_rows[key] = row


def stated_recordings(rows: Sequence[ClipRow]) -> list[str] | None:
    """Return the recordings that the table states, by performer and name; None if it states none.

    Raises RecipeError for a file whose clips are of two recordings.
    """
    if any(row.recording is None for row in rows):
        return None
    first_rows: dict[str, ClipRow] = {}
    for row in rows:
        other = first_rows.setdefault(row.motion, row)
        if _named_recording(other) != _named_recording(row):
            raise row.error(
                f"{row.file.name} is of recording {row.recording!r} here and of "
                f"{other.recording!r} in line {other.line}, expected one for a file: its clips "
                "were recorded in one go"
            )
    return [_named_recording(row) for row in rows]


def _named_recording(row: ClipRow) -> str:
    return f"{row.performer}/{row.recording}"
