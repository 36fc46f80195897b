"""Queries of the rows of a source, whatever it is."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from service.export import bounds
from service.export.blocks import Block, Broken
from service.export.columns import CONTROL, HELD
from service.export.names import Seen, generated
from service.export.query import KEPT, Fault, Query, Survey
from service.motion.errors import QueryError
from service.synthesis import clips
from service.synthesis.question import ClipQuestion, Hold
from service.synthesis.synthesizer import Synthesizer

OWN_NAME = "expected a name of its own: an earlier row has it, capitals count for nothing"


@dataclass(frozen=True)
class Defaults:
    """What holds where a row says nothing; the question's controls are not used."""

    format: str
    question: ClipQuestion = field(default_factory=lambda: ClipQuestion({}))


@dataclass(frozen=True)
class Table:
    """Rows of a block that were read, and all right so far: values by field."""

    block: Block
    values: dict[str, list[Any]]

    def part(self, start: int, stop: int) -> "Table":
        """Rows from start to before stop."""
        values = {field: column[start:stop] for field, column in self.values.items()}
        return Table(self.block.part(start, stop), values)

    def names(self) -> list[str]:
        """What each row is called."""
        first, size = self.block.first, len(self.block)
        given = self.values.get("name", [None] * size)
        return [name or generated(first + i) for i, name in enumerate(given)]


@dataclass(frozen=True)
class Reading:
    """Rows of blocks, for one model.

    blocks: begins anew. place: how the line or row of that number is named in messages.
    """

    blocks: Callable[[], Iterator[Block | Broken]]
    place: Callable[[int], str]
    model: Synthesizer
    usual: Defaults
    count: int | None
    digest: str

    def rows(self) -> Iterator[Query | Fault]:
        """Every row."""
        for part in self._parts():
            if isinstance(part, Fault):
                yield part
            else:
                yield from self._queries(part)

    def survey(self) -> Survey:
        """Every row looked at and none kept."""
        total, faulty, faults = 0, 0, []
        for part in self._parts():
            if isinstance(part, Fault):
                faulty += 1
                faults += [part] if faulty <= KEPT else []
            total += 1 if isinstance(part, Fault) else len(part.block)
        return Survey(total, faulty, tuple(faults))

    def _parts(self) -> Iterator[Table | Fault]:
        """Rows that are all right together, and between them those that are not."""
        seen = Seen()
        for block in self.blocks():
            if isinstance(block, Broken):
                yield Fault(self.place(block.number), block.message)
                continue
            for part in self._sound(block):
                if isinstance(part, Fault) or not _named(block):
                    yield part
                else:
                    yield from self._apart(part, seen)

    def _sound(self, block: Block) -> Iterator[Table | Fault]:
        """Rows with values that can be asked for: a block with a row that is not like that is
        halved until that row is alone."""
        if len(block) == 1:
            yield self._alone(block)
            return
        table = self._together(block)
        if table:
            yield table
            return
        for half in block.halves():
            yield from self._sound(half)

    def _together(self, block: Block) -> Table | None:
        """Rows of a block; none where one of them needs a closer look."""
        try:
            table = Table(block, block.values())
        except ValueError:
            return None
        card, support = self.model.session.card, self.model.door.support
        sound = bounds.pass_all(card, support, table.values, self.usual.question)
        return table if sound else None

    def _alone(self, block: Block) -> Table | Fault:
        try:
            table = Table(block, block.values())
            clips.check(self.model, next(self._queries(table)).question)
        except (ValueError, QueryError) as fault:
            return Fault(self.place(block.numbers[0]), str(fault))
        return table

    def _apart(self, table: Table, seen: Seen) -> Iterator[Table | Fault]:
        """Rows whose names nobody had before."""
        names, start = table.names(), 0
        for place in seen.repeated(names):
            if start < place:
                yield table.part(start, place)
            number = table.block.numbers[place]
            yield Fault(self.place(number), f"name: {names[place]!r}, {OWN_NAME}")
            start = place + 1
        if start < len(names):
            yield table.part(start, len(names)) if start else table

    def _queries(self, table: Table) -> Iterator[Query]:
        for name, number, said in zip(
            table.names(), table.block.numbers, _said(table), strict=True
        ):
            form = said.pop("format", self.usual.format)
            said.pop("name", None)
            hold = self._hold(said)
            controls = self._controls(said)
            question = replace(self.usual.question, controls=controls, hold=hold, **said)
            yield Query(name, form, question, self.place(number))

    def _hold(self, said: dict[str, Any]) -> Hold:
        """What a row is held to, taken out of what it says."""
        held = {field: said.pop(field) for field in HELD if field in said}
        usual = self.usual.question.hold
        return replace(usual, **held) if held else usual

    def _controls(self, said: dict[str, Any]) -> dict[str, float]:
        """Controls of a row, taken out of what it says, in the card's order."""
        return {name: said.pop(CONTROL + name) for name in self._names}

    @cached_property
    def _names(self) -> tuple[str, ...]:
        return tuple(control.name for control in self.model.session.card.controls)


def _named(block: Block) -> bool:
    """Whether rows can say what they are called; names that are generated differ."""
    return any(column.field == "name" for column in block.columns)


def _said(table: Table) -> Iterator[dict[str, Any]]:
    """What each row says, by field."""
    fields = list(table.values)
    for row in zip(*table.values.values(), strict=True):
        yield {field: value for field, value in zip(fields, row, strict=True) if value is not None}
