"""Columns of query tables, and the parsing of their headings.

There is one column for each control of the model and for each label set, by its name, and those of
`OPTION_KINDS`. A heading may state the unit of a control, `speed [m/s]` or `speed (m/s)`, which
must then be the model's. `controls/NAME` is accepted for any control, and `labels/NAME` for any
label set but the performer.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal, get_args, get_origin

from posefield.batch.rows.cells import (
    BooleanCell,
    CellKind,
    ChoiceCell,
    ExactCell,
    FloorCell,
    IntegerCell,
    LabelCell,
    NameCell,
    NumberCell,
    TargetsCell,
)
from posefield.common.name_suggestion import similar_name
from posefield.encode.formats import CLIP_ENCODERS
from posefield.model_file.model_card import PERFORMER, ModelCard
from posefield.question import text_decoding
from posefield.question.motion_question import (
    ExactControls,
    FloorValue,
    Name,
    NamedClipQuestion,
    Target,
)
from posefield.question.text_decoding import Parameter

CONTROL_PREFIX, LABEL_PREFIX = "controls/", "labels/"
MAX_TEXT_LENGTH = 200
"""Longest value that a message repeats, characters."""
WITH_UNIT = re.compile(r"(?P<name>.*?)\s*(\[(?P<square>[^\]]*)\]|\((?P<round>[^)]*)\))")

NO_COLUMN = ("joint_sigma", "labels")
"""Fields of a question without a column; each label set has one."""


def _option_kinds() -> dict[str, Callable[[ModelCard], CellKind]]:
    found: dict[str, Callable[[ModelCard], CellKind]] = {
        "format": lambda _: ChoiceCell(tuple(CLIP_ENCODERS))
    }
    for parameter in text_decoding.parameters(NamedClipQuestion).values():
        if parameter.field not in NO_COLUMN:
            found[parameter.field] = partial(_cell_kind, parameter)
    return found


def _cell_kind(parameter: Parameter, card: ModelCard) -> CellKind:
    """Return the kind of the cells of a field's column."""
    if parameter.field == "performer":
        return ChoiceCell(card.performers)
    if get_origin(parameter.kind) is Literal:
        return ChoiceCell(get_args(parameter.kind))
    if parameter.kind is float:
        return NumberCell(parameter.unit)
    return CELL_KINDS[parameter.kind]


CELL_KINDS: Mapping[Any, CellKind] = {
    int: IntegerCell(),
    bool: BooleanCell(),
    ExactControls: ExactCell(),
    FloorValue: FloorCell(),
    Target: TargetsCell(),
    Name: NameCell(),
}
"""Kind of cells by the type of a field."""

OPTION_KINDS = _option_kinds()
"""All columns except the controls: the format, and the fields of a NamedClipQuestion."""


@dataclass(frozen=True)
class Column:
    """A column of a table.

    field: field of the query; a control's begins with `controls/`. kind: kind of its cells. unit:
    unit that its heading may state.
    """

    field: str
    kind: CellKind
    unit: str | None = None

    @property
    def name(self) -> str:
        """Name in messages."""
        return self.field.removeprefix(CONTROL_PREFIX).removeprefix(LABEL_PREFIX)

    @property
    def control(self) -> bool:
        """True for a control, which every row must have."""
        return self.field.startswith(CONTROL_PREFIX)

    def read(self, reader: Callable[[Sequence[Any]], list[Any]], cells: Sequence[Any]) -> list[Any]:
        """Return the values of cells by one of the kind's parsers.

        Raises ValueError for an invalid cell; the message describes the first cell, so it is exact
        for one cell only.
        """
        try:
            values = reader(cells)
            if self.control and None in values:
                raise ValueError
        except ValueError as fault:
            found = "empty" if cells[0] in ("", None) else shortened_text(cells[0])
            raise ValueError(f"{self.name}: {found}, expected {self.kind.expected}") from fault
        return values


@dataclass(frozen=True)
class Columns:
    """Columns of tables for one model.

    controls: those of the controls, in the card's order. titles: every column by each of its names.
    """

    controls: tuple[Column, ...]
    titles: Mapping[str, Column]

    @property
    def all(self) -> tuple[Column, ...]:
        """All columns, each once."""
        return tuple(dict.fromkeys(self.titles.values()))

    def heading(self, titles: Sequence[str]) -> tuple[Column, ...]:
        """Return the columns of a heading, in its order.

        Raises ValueError for a column that is unknown, repeated, missing or in another unit.
        """
        found = tuple(self.find(title) for title in titles)
        if len(set(found)) < len(found):
            twin = next(column for i, column in enumerate(found) if column in found[:i])
            raise ValueError(f"column {twin.name!r} twice, expected once")
        for control in self.controls:
            if control not in found:
                given = shortened_text(list(titles))
                raise ValueError(
                    f"no column {control.name!r}, expected one of numbers in {control.unit}; "
                    f"found {given}"
                )
        return found

    def find(self, title: str) -> Column:
        """Return the column of a title; ValueError if it is unknown or its unit differs."""
        exact = self.titles.get(title)
        if exact:
            return exact
        stated = WITH_UNIT.fullmatch(title)
        column = self.titles.get(stated["name"]) if stated else None
        if not stated or not column:
            raise ValueError(
                f"unknown column {shortened_text(title)}, {self._closest_title(title)}"
            )
        unit = stated["square"] or stated["round"] or ""
        if unit.strip() != column.unit:
            expected = f"{column.unit}" if column.unit else "none"
            raise ValueError(f"column {column.name!r} in the unit {unit!r}, expected {expected}")
        return column

    def _closest_title(self, title: str) -> str:
        prefixes = (CONTROL_PREFIX, LABEL_PREFIX)
        known = [name for name in self.titles if not name.startswith(prefixes)]
        near = similar_name(title, known)
        return f"did you mean {near!r}?" if near else f"expected one of {', '.join(known)}"


def columns_of(card: ModelCard) -> Columns:
    """Return the columns of tables for a model."""
    controls = tuple(
        Column(CONTROL_PREFIX + c.name, NumberCell(c.unit), c.unit) for c in card.controls
    )
    labels = tuple(
        Column(LABEL_PREFIX + own.name, LabelCell(own.names))
        for own in card.labels
        if own.name != PERFORMER
    )
    options = {name: _option_column(name, kind(card)) for name, kind in OPTION_KINDS.items()}
    named = (*controls, *labels)
    return Columns(controls, {c.name: c for c in named} | options | {c.field: c for c in named})


def shortened_text(value: object) -> str:
    """Return a value as text for messages, truncated to LONGEST characters."""
    whole = repr(value)
    return whole if len(whole) <= MAX_TEXT_LENGTH else f"{whole[:MAX_TEXT_LENGTH]}..."


def _option_column(name: str, kind: CellKind) -> Column:
    return Column(name, kind, kind.unit if isinstance(kind, NumberCell) else None)
