"""Tables of results, made of the files that `posefield evaluate --json` has written."""

import json
from collections.abc import Callable, Iterator
from decimal import Decimal
from functools import cache
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent / "results/evaluation"
FAMILIES = {
    "cmu_walk": "walk",
    "hdm05_grab_high": "grab",
    "hdm05_deposit_floor": "deposit",
    "reaching": "procedural",
}
"""Files of the folder, and the heading of each one's column."""
CLIPS, PERFORMERS, TRUTH = (
    "leave_one_clip_out",
    "leave_one_performer_out",
    "truth",
)
GOALS = "required, desired"
BEYOND = "detected 25 % beyond a control, worst control"
SHOWN = (1, 3, 5)
"""Numbers of clips that a model is adapted with."""
Rows = Iterator[list[str]]
Found = dict[str, Any]


@cache
def protocols(family: str) -> Found:
    """Return the results of a family by protocol."""
    found = json.loads((FOLDER / f"{family}.json").read_text(encoding="utf-8"))
    return {each["protocol"]: each for each in (found, *found["others"])}


def known_performer(family: str) -> Found:
    """Return the results with performers known: takes held out, or the noise-free truth."""
    found = protocols(family)
    return found.get(TRUTH) or found[CLIPS]


def new_performer(family: str) -> Found:
    """Return the results with performers held out."""
    return protocols(family)[PERFORMERS]


def headings(first: str, results: Callable[[str], Found]) -> list[str]:
    """Return the columns of a table with the number of clips of each family."""
    shown = [f"{name} ({results(family)['clips']:,})" for family, name in FAMILIES.items()]
    return [first, *shown]


def errors(results: Callable[[str], Found]) -> Rows:
    """Yield root-relative, global and effector error of each method, cm."""
    methods = {name: None for family in FAMILIES for name in results(family)["methods"]}
    for method in methods:
        cells = [_errors(results(family)["methods"].get(method)) for family in FAMILIES]
        name = method.replace("_", " ")
        yield (
            [f"**{name}**", *(f"**{cell}**" for cell in cells)]
            if method == "posefield"
            else [
                name,
                *cells,
            ]
        )


def _errors(found: Found | None) -> str:
    if not found or "relative_cm" not in found:
        return ""
    return f"{found['relative_cm']:.2f} / {found['global_cm']:.1f} / {found['effector_cm']:.1f}"


def adapted() -> Rows:
    """Yield the root-relative error after adaptation by some clips, cm, and its excess."""
    found = [protocols(family)[CLIPS]["performers"] for family in _adapted_families().values()]
    label = "posefield_adapt_{}".format
    yield ["none (an unseen performer)", *(f"{f[label(1)]['shown_none_cm']:.2f}" for f in found)]
    for count in SHOWN:
        rows = [f[label(count)] for f in found]
        cells = [
            f"{row['relative_cm']:.2f} (+{100 * row['farther_than_all']:.2g} %)" for row in rows
        ]
        yield [f"{count} clip{'s' * (count > 1)}", *cells]
    yield [
        "trained with all other clips (leave one clip out)",
        *(f"{f[label(1)]['shown_all_cm']:.2f}" for f in found),
    ]


def _adapted_families() -> dict[str, str]:
    """Return the families with adapted models, by heading."""
    found = {name: protocols(family).get(CLIPS, {}) for family, name in FAMILIES.items()}
    families = dict(zip(FAMILIES.values(), FAMILIES, strict=True))
    return {name: families[name] for name, each in found.items() if each.get("performers")}


def exact() -> Rows:
    """Yield how exactly targets at captured places are met, and what becomes of those beyond."""
    found = {family: known_performer(family)["methods"] for family in FAMILIES}
    before = [each["posefield"]["effector_cm"] for each in found.values()]
    after = [each["posefield_exact"]["exact"] for each in found.values()]
    pairs = zip(before, after, strict=True)
    cells = [f"{first:.1f} → {_plain(own['effector_cm'], 1)}" for first, own in pairs]
    yield ["effector before → after, cm", *cells, ""]
    for name, form, goal in EXACT_ROWS:
        yield [name, *(form(own) for own in after), goal]


def _mean_and_worst(key: str, digits: int) -> Callable[[Found], str]:
    return lambda own: f"{own[key]:.{digits}f} ({own[key + '_worst']:.{digits}f})"


def _plain(value: float, digits: int) -> str:
    """Return a number with some significant digits and without an exponent."""
    return format(Decimal(f"{value:.{digits}g}"), "f")


def _percent(key: str, sign: str = "") -> Callable[[Found], str]:
    return lambda own: f"{100 * own[key]:{sign}.1f} %"


EXACT_ROWS: tuple[tuple[str, Callable[[Found], str], str], ...] = (
    ("worst clip, cm", lambda own: _plain(own["effector_cm_worst"], 3), "0.1, 0.01"),
    ("steps, mean (most)", _mean_and_worst("steps", 1), "at most 5"),
    ("root-relative error", _percent("relative_change", "+"), "at most +2 %"),
    ("global error", _percent("global_change", "+"), "reaches −2 %, −6 %"),
    (
        "acceleration after / before, mean (worst)",
        _mean_and_worst("acceleration", 2),
        "1.10 (1.35)",
    ),
    ("distance of captured places, deviations", lambda own: f"{own['distance']:.2f}", "1.3 to 1.8"),
    ("captured places reported as out of reach", _percent("out_of_reach"), "5, 3 %"),
    ("places 10 cm beyond, reported", _percent("out_of_reach_10cm"), ""),
    ("20 cm beyond, reported", _percent("out_of_reach_20cm"), "90, 94 %"),
    ("30 cm beyond, reported", _percent("out_of_reach_30cm"), "100 %"),
    ("one metre beyond, reported", _percent("far_out_of_reach"), "100 %"),
    (
        "one metre beyond: acceleration, mean (worst)",
        _mean_and_worst("far_acceleration", 2),
        "1.35",
    ),
    ("one metre beyond: root moved, mean (most), cm", _mean_and_worst("far_root_cm", 1), "12"),
    ("a clip, ms (median, beside other work)", lambda own: f"{own['ms']:.1f}", "5, 2.5"),
)
"""Rows of the table of targets: name, text of a family's figures, required and desired value."""


def support() -> Rows:
    """Yield false alarms of the support flag on held-out clips, and detections beyond controls."""
    for family, name in FAMILIES.items():
        found = protocols(family)[CLIPS]
        if found.get("support"):
            beyond = min(found["support"]["beyond"].values())
            controls = f"{found['clips']} clips, {len(found['support']['beyond'])} controls"
            false_alarms = f"{100 * found['support']['false_alarms']:.1f} %"
            yield [f"{name} ({controls})", false_alarms, f"{100 * beyond:.0f} %", ""]


TABLES: dict[str, Callable[[], tuple[list[str], Rows]]] = {
    "clips": lambda: (headings("method", known_performer), errors(known_performer)),
    "performers": lambda: (headings("method", new_performer), errors(new_performer)),
    "adapted": lambda: (["clips given to `posefield adapt`", *_adapted_families()], adapted()),
    "exact": lambda: ([*headings("target at the event", known_performer), GOALS], exact()),
    "support": lambda: (["family", "false alarms", BEYOND, "in the gap"], support()),
}
"""Columns and rows of each table, by the name that a file of results refers to it by."""
