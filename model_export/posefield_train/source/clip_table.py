"""Table of clips: one validated row per clip."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from posefield.common.errors import RecipeError
from posefield.common.units import Floats
from posefield_train.source import data_folder, shipped_recipes, table_cells
from posefield_train.source.data_folder import FileLocation
from posefield_train.source.recipe import Recipe
from posefield_train.source.recipe_sections.data_sections import PERFORMER, Clips
from posefield_train.source.table_cells import ClipTable, FrameSpans


@dataclass(frozen=True)
class ClipRow:
    """One clip: its file, frames, and controls.

    line: in the table, for messages; None without table. first_frame, last_frame: indices in the
    file from 0, last_frame inclusive; None is the end of the file. controls: those of the table.
    landmarks: frames of the file. other_labels: name of the clip in each further label set. take:
    name of the take, unique among the performer's; None if the table has no such column.
    curve_place: file of the clip's curves; None without them, and where the clip has curves alone.
    contacts: first and last frame in the file of each contact, by column. animation: name of one
    of several in the file; None for the only one.
    """

    place: FileLocation
    table: str
    line: int | None
    performer: str
    first_frame: int
    last_frame: int | None
    controls: Floats
    landmarks: tuple[int, ...]
    take: str | None = None
    other_labels: Mapping[str, str] = field(default_factory=dict)

    curve_place: FileLocation | None = None
    contacts: Mapping[str, FrameSpans] = field(default_factory=dict)
    animation: str | None = None

    @property
    def motion(self) -> str:
        """Return the name of the motion that the clip is a part of: its file and animation."""
        return str(self.place) if self.animation is None else f"{self.place}[{self.animation}]"

    @property
    def labels(self) -> dict[str, str]:
        """Return the name of the clip in each label set, the performer's included."""
        return {PERFORMER: self.performer, **self.other_labels}

    @property
    def curve_file(self) -> FileLocation:
        """Return the file of the clip's curves."""
        return self.curve_place or self.place

    @property
    def named(self) -> str:
        """Return the name of the row in messages: its line and its file."""
        return self.place.name if self.line is None else f"line {self.line}, {self.place.name}"

    @property
    def source(self) -> str:
        """Return the file's name, with frames if the clip is a part of it."""
        if self.first_frame == 0 and self.last_frame is None:
            return self._motion_name
        last = "the end" if self.last_frame is None else self.last_frame
        return f"{self._motion_name}, frames {self.first_frame} to {last}"

    @property
    def _motion_name(self) -> str:
        """Return the name of the file, with the animation if it holds several."""
        return self.place.name if self.animation is None else f"{self.place.name}[{self.animation}]"

    def error(self, message: str) -> RecipeError:
        """Return an error that names this row."""
        return RecipeError(self.table, message, self.line)


def read(recipe: Recipe, folder: Path) -> list[ClipRow]:
    """Return the rows of the recipe's table that meet its conditions.

    If the folder lacks the table, the one beside the recipe is read, else the shipped one of its
    name, if there is one. Raises RecipeError, naming line and column, for the first invalid cell,
    and for a missing column, no matching row, and two rows of the same frames.
    """
    place = shipped_recipes.find_table(folder, recipe.clips.table, recipe.folder)
    cells = table_cells.open_table(place)
    cells.require(_columns(recipe))
    rows = [
        _row(recipe, folder, cells, line, record)
        for line, record in cells.records
        if all(cells.satisfies(line, record, c, w) for c, w in recipe.clips.where.items())
    ]
    if not rows:
        raise RecipeError(cells.name, f"none of {len(cells.records)} rows meets the conditions")
    refuse_repeats(rows)
    return rows


def _columns(recipe: Recipe) -> dict[str, str]:
    clips = recipe.clips
    named = {
        clips.file: "clips.file",
        **dict.fromkeys(clips.where, "clips.where"),
        **dict.fromkeys(clips.landmarks, "clips.landmarks"),
        **{column: f"clips.labels.{name}" for name, column in clips.labels.items()},
        **{control.column: f"control {control.name}" for control in recipe.column_controls},
    }
    named |= {column: f"contacts.columns.{j}" for j, column in recipe.contacts.columns.items()}
    for key in ("animation", "performer", "take", "first_frame", "last_frame"):
        column = getattr(clips, key)
        if column is not None:
            named[column] = f"clips.{key}"
    if recipe.curves and recipe.curves.column:
        named[recipe.curves.column] = "curves.column"
    return named


def _row(
    recipe: Recipe, folder: Path, cells: ClipTable, line: int, record: dict[str, str]
) -> ClipRow:
    clips = recipe.clips
    first = cells.frame(line, record, clips.first_frame) if clips.first_frame else 0
    last = cells.frame(line, record, clips.last_frame) if clips.last_frame else None
    if last is not None and last <= first:
        raise RecipeError(cells.name, f"frames {first} to {last}, expected at least two", line)
    find = _FileFinder(folder, clips, cells.name, line)
    return ClipRow(
        place=find(clips.file, record[clips.file]),
        table=cells.name,
        line=line,
        performer=_performer(recipe, cells, line, record),
        first_frame=first,
        last_frame=last,
        controls=np.array([cells.number(line, record, c.column) for c in recipe.column_controls]),
        landmarks=tuple(cells.frame(line, record, column) for column in clips.landmarks),
        other_labels={
            name: cells.name_of(line, record, column) for name, column in clips.labels.items()
        },
        take=_take(clips, cells, line, record),
        curve_place=_curve_place(recipe, find, record),
        contacts={
            column: cells.spans(line, record, column) for column in recipe.contacts.columns.values()
        },
        animation=(record[clips.animation].strip() or None) if clips.animation else None,
    )


def _performer(recipe: Recipe, cells: ClipTable, line: int, record: dict[str, str]) -> str:
    """Return the performer of a row, which a label of that set makes a name of requests."""
    column = recipe.clips.performer
    if column is None:
        return ""
    labelled = PERFORMER in recipe.kriging.label
    return cells.name_of(line, record, column) if labelled else record[column]


def _take(clips: Clips, cells: ClipTable, line: int, record: dict[str, str]) -> str | None:
    if clips.take is None:
        return None
    name = record[clips.take].strip()
    if not name:
        raise RecipeError(
            cells.name, f"column {clips.take!r}: nothing, expected the name of a take", line
        )
    return name


@dataclass(frozen=True)
class _FileFinder:
    """Finder of the files that a line of the table names."""

    folder: Path
    clips: Clips
    table: str
    line: int

    def __call__(self, column: str, cell: str) -> FileLocation:
        """Return the file that a cell names; RecipeError names the column."""
        beside = self.clips.table.rpartition("/")[0]
        name = f"{beside}/{cell}" if beside else cell
        try:
            return data_folder.find(self.folder, name)
        except RecipeError as fault:
            text = f"column {column!r}: {fault.message}"
            raise RecipeError(self.table, text, self.line) from fault


def _curve_place(recipe: Recipe, find: _FileFinder, record: dict[str, str]) -> FileLocation | None:
    """Return the file of a clip's curves beside its motion file; None if there is none."""
    keys, column = recipe.curves, recipe.clips.file
    if keys is None or keys.alone:
        return None
    if keys.column:
        return find(keys.column, record[keys.column])
    folder, slash, name = record[column].rpartition("/")
    stem = name.rpartition(".")[0] or name
    return find(column, f"{folder}{slash}{stem}{keys.suffix}")


def refuse_repeats(rows: Sequence[ClipRow]) -> None:
    """Raise RecipeError for two rows with the same frames of the same file."""
    seen: dict[tuple[str, int, int | None], ClipRow] = {}
    for row in rows:
        key = (row.motion, row.first_frame, row.last_frame)
        if key in seen:
            line = seen[key].line
            again = "as before" if line is None else f"as line {line}"
            raise row.error(f"the same frames of the same file {again}")
        seen[key] = row


def stated_takes(rows: Sequence[ClipRow]) -> list[str] | None:
    """Return the takes that the table states, by performer and name; None if it states none.

    Raises RecipeError for a file whose clips are of two takes.
    """
    if any(row.take is None for row in rows):
        return None
    seen: dict[str, ClipRow] = {}
    for row in rows:
        other = seen.setdefault(row.motion, row)
        if _named_take(other) != _named_take(row):
            raise row.error(
                f"{row.place.name} is of take {row.take!r} here and of take {other.take!r} in line "
                f"{other.line}, expected one take for a file: its clips were recorded in one go"
            )
    return [_named_take(row) for row in rows]


def _named_take(row: ClipRow) -> str:
    return f"{row.performer}/{row.take}"
