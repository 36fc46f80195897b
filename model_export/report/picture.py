"""Figures as SVG elements that stand in a page: one look, and the same bytes each time."""

import io
import re
from collections.abc import Callable
from dataclasses import dataclass

from matplotlib import style
from matplotlib.figure import Figure

# Dark enough for white paper, and told apart by those who see red and green alike.
INK, GREY, FAINT, BLUE, ORANGE = "#24313f", "#7b8794", "#b9c2cc", "#2b6ca3", "#d9660a"
WIDTH = 10.0
# Pixels an inch of what has too many points to be drawn as lines.
DOTS = 170

_LOOK = {
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
    "svg.hashsalt": "posefield",
    "text.color": INK,
    "xtick.color": "#52606d",
    "ytick.color": "#52606d",
}
_NO_METADATA = dict.fromkeys(("Creator", "Date", "Format", "Type"))
# What refers to something within the picture, which must not meet another picture's.
_NAMES = re.compile(r'(\bid="|href="#|url\(#)')


@dataclass(frozen=True)
class Picture:
    """An SVG element, what it shows to who cannot see it, and the words beneath it."""

    svg: str
    alt: str
    caption: str


def draw(
    name: str, height: float, paint: Callable[[Figure], None], alt: str, caption: str
) -> Picture:
    """Picture of what `paint` draws; height in inches, its name unique in the page."""
    buffer = io.StringIO()
    # Whatever the user's own matplotlibrc says.
    with style.context(["default", _LOOK]):
        figure = Figure((WIDTH, height), layout="constrained")
        paint(figure)
        figure.savefig(buffer, format="svg", dpi=DOTS, metadata=_NO_METADATA)
    return Picture(_element(buffer.getvalue(), name), alt, caption)


def _element(svg: str, name: str) -> str:
    """The file's element alone, as wide as the page gives it, its names its own."""
    element = svg[svg.index("<svg") :].strip()
    # This style would hold for the whole page, which says the same for pictures only.
    element = re.sub(r"<defs>\s*<style.*?</style>\s*</defs>", "", element, count=1, flags=re.DOTALL)
    element = re.sub(r' width="[^"]*" height="[^"]*"', "", element, count=1)
    return _NAMES.sub(rf"\1{name}-", element)
