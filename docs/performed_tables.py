"""Tables of figures with a value that they must have and one that is wished for.

`performed.json` is written by benchmarks/performances.py, `joins.json` by benchmarks/joins.py,
`discovered.json` by benchmarks/discovery.py, `scaled.json` by benchmarks/scale.py.
"""

from collections.abc import Iterator
from typing import Any

import measured_tables

COLUMNS = ["figure", "value", "must", "wish", "remark"]
WISHES = {
    "hdm05_grab_high": {"peak over the real one": 1.3},
    "cmu_walk": {"peak over the real one": 1.0},
}
"""Wishes for joins of captured takes, by recipe and measure; slides and heights have their own."""
OTHER_WISHES = {"slide of standing feet": 0.2, "pelvis lowered": 2.0}
DISCOVERY_WISHES = {
    "strides: missed": 0.0,
    "one example: missed by the best R": 5.0,
    "processor time of reading and features": 10.0,
}
SCALE_WISHES = {
    "92 clips: processor time": 8.0,
    "2,000 clips: distance to the truth": 0.4,
    "2,000 clips: error of new clips over sigma": 1.2,
} | {f"{clips} clips: file": 200.0 for clips in ("300", "1,000", "2,000")}
Rows = Iterator[list[str]]


def performed() -> Rows:
    """Yield the figures of performances of models."""
    yield from _rows(measured_tables.read("performed")["rows"])


def joins() -> Rows:
    """Yield the figures of joins of captured takes."""
    for row in measured_tables.read("joins")["rows"]:
        subject, _, measure = row["name"].partition(": ")
        recipe = subject.partition(",")[0]
        wishes = OTHER_WISHES | WISHES.get(recipe, {})
        yield from _rows([row | {"wish": wishes.get(measure)}])


def discovered() -> Rows:
    """Yield the figures of clips found in long takes."""
    for row in measured_tables.read("discovered")["rows"]:
        yield from _rows([row | {"wish": DISCOVERY_WISHES.get(row["name"])}])


def scaled() -> Rows:
    """Yield the figures of families of any number of clips."""
    for row in measured_tables.read("scaled")["rows"]:
        yield from _rows([row | {"wish": SCALE_WISHES.get(row["name"])}])


def _rows(found: list[dict[str, Any]]) -> Rows:
    for row in found:
        value = f"{measured_tables.number(row['value'])} {row['unit']}"
        limits = [_limit(row, row[name]) for name in ("goal", "wish")]
        yield [row["name"], value, *limits, row["baseline"]]


def _limit(row: dict[str, Any], most: float | None) -> str:
    """Return the most that a figure may be, and whether it is no more; empty without one."""
    if most is None:
        return ""
    verdict = "met" if row["value"] <= most else "**missed**"
    return f"{measured_tables.number(most)} {row['unit']}, {verdict}"
