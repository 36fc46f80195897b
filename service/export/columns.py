"""Which columns a table of queries may have, and what a heading means.

One column for each control of the model, by its name, and those of `OPTIONS`. A heading may state
the unit of a control, `speed [m/s]` or `speed (m/s)`, and then it must be the model's. A control
with the name of an option is `controls/NAME`, as any control may be written.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any, get_args

from service.encode import ENCODERS
from service.export.cells import Exact, Flag, Kind, Name, Number, Targets, Whole, Word
from service.motion.card import ModelCard
from service.motion.roles import Names
from service.synthesis.question import Policy, Root

CONTROL = "controls/"
LONGEST = 200
"""Characters of what was found that a message repeats."""
WITH_UNIT = re.compile(r"(?P<name>.*?)\s*(\[(?P<square>[^\]]*)\]|\((?P<round>[^)]*)\))")

OPTIONS: Mapping[str, Callable[[ModelCard], Kind]] = {
    "name": lambda _: Name(),
    "format": lambda _: Word(tuple(ENCODERS)),
    "fps": lambda _: Number("frames a second"),
    "level": lambda _: Whole(),
    "start": lambda _: Number("s"),
    "end": lambda _: Number("s"),
    "performer": lambda card: Word(card.performers),
    "extrapolate": lambda _: Word(get_args(Policy)),
    "names": lambda _: Word(get_args(Names)),
    "root": lambda _: Word(get_args(Root)),
    "loop": lambda _: Flag(),
    "exact": lambda _: Exact(),
    "targets": lambda _: Targets(),
    "pin_feet": lambda _: Flag(),
}
"""Every column but the controls; those that are neither name nor format are fields of a
ClipQuestion, or of what that is held to."""

HELD = ("exact", "targets", "pin_feet")
"""Fields of a Hold."""


@dataclass(frozen=True)
class Column:
    """A column: field, what of a query it says, a control's with `controls/` before its name;
    what its cells hold; and the unit that its heading may state."""

    field: str
    kind: Kind
    unit: str | None = None

    @property
    def name(self) -> str:
        """How it is called in messages."""
        return self.field.removeprefix(CONTROL)

    @property
    def control(self) -> bool:
        """Whether it is a control, which every row must state."""
        return self.field.startswith(CONTROL)

    def read(self, reader: Callable[[Sequence[Any]], list[Any]], cells: Sequence[Any]) -> list[Any]:
        """Values of cells by one of the kind's readers; ValueError says what is wrong with the
        first if there is but one."""
        try:
            values = reader(cells)
            if self.control and None in values:
                raise ValueError
        except ValueError as fault:
            found = "empty" if cells[0] in ("", None) else shown(cells[0])
            raise ValueError(f"{self.name}: {found}, expected {self.kind.expected}") from fault
        return values


@dataclass(frozen=True)
class Columns:
    """Columns of tables for one model: controls in the card's order, and the others."""

    controls: tuple[Column, ...]
    titles: Mapping[str, Column]

    @property
    def all(self) -> tuple[Column, ...]:
        """Every column once."""
        return tuple(dict.fromkeys(self.titles.values()))

    def heading(self, titles: Sequence[str]) -> tuple[Column, ...]:
        """Columns that a heading names, in its order.

        ValueError for a column that is unknown, there twice, missing or in another unit.
        """
        found = tuple(self.find(title) for title in titles)
        if len(set(found)) < len(found):
            twin = next(column for i, column in enumerate(found) if column in found[:i])
            raise ValueError(f"column {twin.name!r} twice, expected once")
        for control in self.controls:
            if control not in found:
                given = shown(list(titles))
                raise ValueError(
                    f"no column {control.name!r}, expected one of numbers in {control.unit}; "
                    f"found {given}"
                )
        return found

    def find(self, title: str) -> Column:
        """The column of a title; ValueError where there is none, or its unit is another."""
        exact = self.titles.get(title)
        if exact:
            return exact
        stated = WITH_UNIT.fullmatch(title)
        column = self.titles.get(stated["name"]) if stated else None
        if not stated or not column:
            raise ValueError(f"unknown column {shown(title)}, {self._instead(title)}")
        unit = stated["square"] or stated["round"] or ""
        if unit.strip() != column.unit:
            expected = f"{column.unit}" if column.unit else "none"
            raise ValueError(f"column {column.name!r} in the unit {unit!r}, expected {expected}")
        return column

    def _instead(self, title: str) -> str:
        plain = {name.lower(): name for name in self.titles if not name.startswith(CONTROL)}
        near = get_close_matches(title.lower(), plain, n=1)
        if near:
            return f"did you mean {plain[near[0]]!r}?"
        return f"expected one of {', '.join(plain.values())}"


def of(card: ModelCard) -> Columns:
    """Columns of tables for a model."""
    controls = tuple(Column(CONTROL + c.name, Number(c.unit), c.unit) for c in card.controls)
    options = {name: _option(name, kind(card)) for name, kind in OPTIONS.items()}
    return Columns(
        controls,
        {c.name: c for c in controls} | options | {c.field: c for c in controls},
    )


def shown(value: object) -> str:
    """What was found, for messages: not all of what is long."""
    whole = repr(value)
    return whole if len(whole) <= LONGEST else f"{whole[:LONGEST]}..."


def _option(name: str, kind: Kind) -> Column:
    return Column(name, kind, kind.unit if isinstance(kind, Number) else None)
