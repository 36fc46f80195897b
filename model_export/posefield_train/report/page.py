"""Self-contained HTML page of sections, tables and SVG charts in one style.

Equal data give equal bytes.
"""

import base64
import io
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import getitem
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from matplotlib import style
from matplotlib.figure import Figure

# Readable on white, and distinguishable with red-green colour blindness.
INK, GREY, FAINT, BLUE, ORANGE = "#24313f", "#7b8794", "#b9c2cc", "#2b6ca3", "#d9660a"
WIDTH = 10.0
"""Inches."""
LABEL = 28
"""Characters of a label: a longer one would leave no space for the chart."""
# Resolution of point clouds, which are embedded as bitmaps.
DOTS_PER_INCH = 170

_STYLE = {
    "axes.axisbelow": True,
    "axes.edgecolor": GREY,
    "axes.grid": True,
    "axes.labelcolor": INK,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titlesize": 10,
    "axes.titleweight": "bold",
    "figure.constrained_layout.w_pad": 0.08,
    "figure.dpi": 100,
    "font.sans-serif": ["DejaVu Sans", "Verdana", "Arial", "sans-serif"],
    "font.size": 9,
    "grid.color": "#e6eaee",
    "grid.linewidth": 0.7,
    "legend.fontsize": 8.5,
    "legend.frameon": False,
    "lines.linewidth": 1.4,
    "svg.fonttype": "none",
    # Without a fixed salt the ids in the file are random.
    "svg.hashsalt": "posefield",
    "text.color": INK,
    # Labels are user-given text, in which "$" does not start a formula.
    "text.parse_math": False,
    "xtick.color": "#52606d",
    "ytick.color": "#52606d",
}
_NO_METADATA = dict.fromkeys(("Creator", "Date", "Format", "Type"))


@dataclass(frozen=True)
class Chart:
    """SVG file, its text alternative and its caption."""

    svg: bytes
    alt: str
    caption: str

    @property
    def source(self) -> str:
        """Return the data URI of the image."""
        return f"data:image/svg+xml;base64,{base64.b64encode(self.svg).decode()}"


def draw_chart(height: float, paint: Callable[[Figure], None], alt: str, caption: str) -> Chart:
    """Return the chart that `paint` draws on an empty figure of WIDTH × height inches."""
    buffer = io.BytesIO()
    # "default" undoes the settings of the user's own matplotlibrc.
    with style.context(["default", _STYLE]):
        figure = Figure((WIDTH, height), layout="constrained")
        paint(figure)
        figure.savefig(buffer, format="svg", dpi=DOTS_PER_INCH, metadata=_NO_METADATA)
    return Chart(buffer.getvalue(), alt, caption)


def short_label(text: str) -> str:
    """Return a user-given name as the label of a chart, with "…" for what exceeds LABEL."""
    return text if len(text) <= LABEL else f"{text[: LABEL - 1]}…"


_NUMBER = re.compile(r"[-+]?[\d.,]+( ?%| cm)?")


Column = tuple[str, str, Callable[[Any], str]]
"""Title, path of the figure in its row, such as "controls/speed", and function to its text."""


def centimetres(metres: float) -> str:
    """Return a length as centimetres."""
    return f"{100 * metres:.2f}"


def percent(share: float) -> str:
    """Return a share as whole percent."""
    return f"{100 * share:.0f} %"


def product(sizes: Iterable[int]) -> str:
    """Return sizes such as 12 × 20 × 15."""
    return " × ".join(map(str, sizes))


@dataclass(frozen=True)
class Table:
    """Table of text cells: caption, column titles, and rows of as many cells."""

    caption: str
    heading: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    @classmethod
    def of(cls, caption: str, figures: Iterable[Mapping[str, Any]], *columns: Column) -> "Table":
        """Return the table of figures that are in the JSON too, a row each."""
        rows = tuple(
            tuple(text(reduce(getitem, path.split("/"), row)) for _, path, text in columns)
            for row in figures
        )
        return cls(caption, tuple(title for title, *_ in columns), rows)

    @property
    def numeric(self) -> tuple[bool, ...]:
        """Return, per column, True if all cells are numbers or empty."""
        return tuple(
            all(not cell or _NUMBER.fullmatch(cell) for cell in column)
            for column in zip(*self.rows, strict=True)
        )


@dataclass(frozen=True)
class Section:
    """Section of a page, and its figures.

    name: its anchor, of letters and hyphens, unique in the page. facts: JSON values, in metres,
    seconds and shares.
    """

    name: str
    title: str
    paragraphs: tuple[str, ...]
    tables: tuple[Table, ...] = ()
    charts: tuple[Chart, ...] = ()
    facts: Any = None


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
            loader=PackageLoader("posefield_train.report"),
            autoescape=True,
            undefined=StrictUndefined,
            trim_blocks=True,
            lstrip_blocks=True,
            keep_trailing_newline=True,
        )
        return environment.get_template("page.html").render(page=self).encode()
