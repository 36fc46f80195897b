"""Self-contained HTML page of sections, tables and charts."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from posefield_train.report.drawing.svg_chart import Chart

_NUMBER = re.compile(r"[-+]?[\d.,]+( ?%| cm)?")


@dataclass(frozen=True)
class Table:
    """Table of text cells: caption, column titles, and rows of as many cells."""

    caption: str
    heading: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    @property
    def numeric(self) -> tuple[bool, ...]:
        """Return, per column, True if all cells are numbers or empty."""
        return tuple(
            all(not cell or _NUMBER.fullmatch(cell) for cell in column)
            for column in zip(*self.rows, strict=True)
        )


@dataclass(frozen=True)
class Section:
    """Section of a page. name: its anchor, of letters and hyphens, unique in the page."""

    name: str
    title: str
    paragraphs: tuple[str, ...]
    tables: tuple[Table, ...] = ()
    charts: tuple[Chart, ...] = ()


@dataclass(frozen=True)
class Chapter:
    """Part of a report. facts: JSON values, in metres, seconds and shares. section: of the page."""

    facts: Any
    section: Section


@dataclass(frozen=True)
class Page:
    """Page of sections.

    kind: type of document, such as "training report". lead: text below the title. figures: name and
    value of the key figures at the top.
    """

    kind: str
    title: str
    lead: str
    figures: Sequence[tuple[str, str]]
    sections: Sequence[Section]

    def html(self) -> bytes:
        """Return the file; all text is escaped."""
        environment = Environment(
            loader=PackageLoader("posefield_train.report.drawing"),
            autoescape=True,
            undefined=StrictUndefined,
            trim_blocks=True,
            lstrip_blocks=True,
            keep_trailing_newline=True,
        )
        return environment.get_template("page.html").render(page=self).encode()
