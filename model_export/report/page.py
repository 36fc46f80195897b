"""The page: sections of words, tables and pictures in one HTML file that loads nothing."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from string import Template
from typing import Any, Protocol

from model_export.report.picture import Picture


@dataclass(frozen=True)
class Table:
    """Rows of cells under a heading; numbers come as text, rounded to what is worth reading."""

    heading: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class Section:
    """name: its anchor. words: paragraphs of plain text."""

    name: str
    title: str
    words: tuple[str, ...]
    tables: tuple[Table, ...] = ()
    pictures: tuple[Picture, ...] = ()


class Chapter(Protocol):
    """What a part of the report has to say, as plain JSON values and as a section."""

    def facts(self) -> dict[str, Any]:
        """Numbers in metres, seconds and plain shares."""

    def section(self) -> Section:
        """The same in words and pictures, in centimetres."""


def html(
    kind: str, title: str, lead: str, figures: Sequence[tuple[str, str]], body: Sequence[Section]
) -> str:
    """The whole page; figures: the few numbers that stand at its top, with what they are."""
    template = Template(Path(__file__).with_name("page.html").read_text(encoding="utf-8"))
    return template.substitute(
        kind=escape(kind),
        title=escape(title),
        lead=escape(lead),
        figures="\n".join(
            f"<div><dt>{escape(name)}</dt><dd>{escape(value)}</dd></div>" for name, value in figures
        ),
        contents="\n".join(f'<a href="#{s.name}">{escape(s.title)}</a>' for s in body),
        body="\n".join(map(_section, body)),
    )


def _section(section: Section) -> str:
    parts = [
        f'<section id="{section.name}">',
        f"<h2>{escape(section.title)}</h2>",
        *(f"<p>{escape(paragraph)}</p>" for paragraph in section.words),
        *map(_table, section.tables),
        *map(_figure, section.pictures),
        "</section>",
    ]
    return "\n".join(parts)


def _table(table: Table) -> str:
    heading = "".join(f'<th scope="col">{escape(cell)}</th>' for cell in table.heading)
    rows = "\n".join(map(_row, table.rows))
    return (
        f'<div class="wide"><table><thead><tr>{heading}</tr></thead>'
        f"<tbody>\n{rows}\n</tbody></table></div>"
    )


def _row(cells: tuple[str, ...]) -> str:
    first, *rest = map(escape, cells)
    return f'<tr><th scope="row">{first}</th>' + "".join(f"<td>{c}</td>" for c in rest) + "</tr>"


def _figure(picture: Picture) -> str:
    opened = f'<svg role="img" aria-label="{escape(picture.alt)}"'
    return (
        f'<figure><div class="card">{picture.svg.replace("<svg", opened, 1)}</div>'
        f"<figcaption>{escape(picture.caption)}</figcaption></figure>"
    )
