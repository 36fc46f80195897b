"""Parsing and validation of a source's rows to queries."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from msgspec import structs

from posefield.batch.rows import row_bounds
from posefield.batch.rows.clip_names import UsedNames, generated_name
from posefield.batch.rows.columns import CONTROL_PREFIX, LABEL_PREFIX
from posefield.batch.rows.row_blocks import BrokenRow, RowBlock
from posefield.batch.rows.row_query import MAX_KEPT_FAULTS, ClipQuery, RowFault, RowSurvey
from posefield.common.errors import QueryError
from posefield.question.motion_question import ClipQuestion, LabelValue
from posefield.synthesis import clips
from posefield.synthesis.synthesizer import Synthesizer

REPEATED_NAME = "expected a name of its own: an earlier row has it, capitals count for nothing"


@dataclass(frozen=True)
class Defaults:
    """Defaults of missing values; the question's controls are not used."""

    format: str
    question: ClipQuestion = field(default_factory=lambda: ClipQuestion(controls={}))


@dataclass(frozen=True)
class ParsedBlock:
    """Parsed rows of a block, valid so far: values by field."""

    block: RowBlock
    values: dict[str, list[Any]]

    def part(self, start: int, stop: int) -> "ParsedBlock":
        """Return the rows from `start` to before `stop`."""
        values = {field: column[start:stop] for field, column in self.values.items()}
        return ParsedBlock(self.block.part(start, stop), values)

    def names(self) -> list[str]:
        """Return the name of each row, given or generated."""
        first, size = self.block.first, len(self.block)
        given = self.values.get("name", [None] * size)
        return [name or generated_name(first + i) for i, name in enumerate(given)]


@dataclass(frozen=True)
class RowReader:
    """Queries of the rows of a source, for one model.

    blocks: yields all blocks anew at each call. place: returns the name of a line or row for
    messages. usual: defaults of missing values. digest: of the source.
    """

    blocks: Callable[[], Iterator[RowBlock | BrokenRow]]
    place: Callable[[int], str]
    model: Synthesizer
    usual: Defaults
    digest: str

    def rows(self) -> Iterator[ClipQuery | RowFault]:
        """Yield a query or a fault for every row."""
        for part in self._parts():
            if isinstance(part, RowFault):
                yield part
            else:
                yield from self._queries(part)

    def survey(self) -> RowSurvey:
        """Validate every row without keeping any."""
        total, faulty, faults = 0, 0, []
        for part in self._parts():
            if isinstance(part, RowFault):
                faulty += 1
                faults += [part] if faulty <= MAX_KEPT_FAULTS else []
            total += 1 if isinstance(part, RowFault) else len(part.block)
        return RowSurvey(total, faulty, tuple(faults))

    def _parts(self) -> Iterator[ParsedBlock | RowFault]:
        """Yield tables of valid rows, and faults in their place between them."""
        seen = UsedNames()
        for block in self.blocks():
            if isinstance(block, BrokenRow):
                yield RowFault(self.place(block.number), block.message)
                continue
            for part in self._valid_blocks(block):
                if isinstance(part, RowFault) or not _may_give_names(block):
                    yield part
                else:
                    yield from self._split_repeated_names(part, seen)

    def _valid_blocks(self, block: RowBlock) -> Iterator[ParsedBlock | RowFault]:
        """Yield tables of rows with valid values, and faults.

        A block with an invalid row is halved until that row is alone.
        """
        if len(block) == 1:
            yield self._parse_alone(block)
            return
        table = self._parse_together(block)
        if table:
            yield table
            return
        for half in block.halves():
            yield from self._valid_blocks(half)

    def _parse_together(self, block: RowBlock) -> ParsedBlock | None:
        """Return the parsed rows of a block; None if one of them needs validation by itself."""
        try:
            table = ParsedBlock(block, block.values())
        except ValueError:
            return None
        card, support = self.model.session.card, self.model.validator.support
        sound = row_bounds.all_valid(card, support, table.values, self.usual.question)
        return table if sound else None

    def _parse_alone(self, block: RowBlock) -> ParsedBlock | RowFault:
        try:
            table = ParsedBlock(block, block.values())
            clips.check(self.model, next(self._queries(table)).question)
        except (ValueError, QueryError) as fault:
            return RowFault(self.place(block.numbers[0]), str(fault))
        return table

    def _split_repeated_names(
        self, table: ParsedBlock, seen: UsedNames
    ) -> Iterator[ParsedBlock | RowFault]:
        """Yield the rows with new names, and faults for repeated names."""
        names, start = table.names(), 0
        for place in seen.find_repeated(names):
            if start < place:
                yield table.part(start, place)
            number = table.block.numbers[place]
            yield RowFault(self.place(number), f"name: {names[place]!r}, {REPEATED_NAME}")
            start = place + 1
        if start < len(names):
            yield table.part(start, len(names)) if start else table

    def _queries(self, table: ParsedBlock) -> Iterator[ClipQuery]:
        for name, number, said in zip(
            table.names(), table.block.numbers, _row_values(table), strict=True
        ):
            form = said.pop("format", self.usual.format)
            said.pop("name", None)
            controls = self._controls(said)
            labels = dict(self.usual.question.labels) | self._labels(said)
            question = structs.replace(
                self.usual.question, controls=controls, labels=labels, **said
            )
            yield ClipQuery(name, form, question, self.place(number))

    def _controls(self, said: dict[str, Any]) -> dict[str, float]:
        """Return the controls of a row in the card's order, removed from `said`."""
        return {name: said.pop(CONTROL_PREFIX + name) for name in self._names}

    def _labels(self, said: dict[str, Any]) -> dict[str, LabelValue]:
        """Return the labels of a row by label set, removed from `said`."""
        given = [field for field in said if field.startswith(LABEL_PREFIX)]
        return {field.removeprefix(LABEL_PREFIX): said.pop(field) for field in given}

    @cached_property
    def _names(self) -> tuple[str, ...]:
        return tuple(control.name for control in self.model.session.card.controls)


def _may_give_names(block: RowBlock) -> bool:
    """Return whether rows may give names; generated names are unique."""
    return any(column.field == "name" for column in block.columns)


def _row_values(table: ParsedBlock) -> Iterator[dict[str, Any]]:
    """Yield the given values of each row, by field."""
    fields = list(table.values)
    for row in zip(*table.values.values(), strict=True):
        yield {field: value for field, value in zip(fields, row, strict=True) if value is not None}
