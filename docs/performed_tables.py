"""Tables of figures with a value that they must have and one that is wished for."""

from collections.abc import Iterator
from typing import Any

import measured_tables

COLUMNS = ["figure", "value", "must", "wish", "remark"]
WISHES = {
    "joins": {
        "slide of standing feet": 0.2,
        "pelvis lowered": 2.0,
        "hdm05_grab_high, 25 joins: peak over the real one": 1.3,
        "cmu_walk, 69 joins: peak over the real one": 1.0,
    },
    "discovered": {
        "strides: missed": 0.0,
        "one example: missed by the best R": 5.0,
        "processor time of reading and features": 10.0,
    },
    "found_families": {"clips of families: wrong": 5.0, "all actions: cuts missed": 5.0},
    "scaled": {
        "92 clips: processor time": 8.0,
        "2,000 clips: distance to the truth": 0.4,
        "2,000 clips: error of new clips over sigma": 1.2,
        **{f"{clips} clips: file": 200.0 for clips in ("300", "1,000", "2,000")},
    },
}
"""Wishes for figures by table, and by their name or the part of it after the subject."""


def rows(table: str) -> Iterator[list[str]]:
    """Yield the figures of a table; those of performances have their wish in the file."""
    wishes = WISHES.get(table, {})
    for row in measured_tables.read(table)["rows"]:
        wish = row.get("wish", wishes.get(row["name"], wishes.get(row["name"].partition(": ")[2])))
        value = f"{measured_tables.number(row['value'])} {row['unit']}"
        limits = [_limit(row, most) for most in (row["goal"], wish)]
        yield [row["name"], value, *limits, row["baseline"]]


def _limit(row: dict[str, Any], most: float | None) -> str:
    """Return the most that a figure may be, and whether it is no more; empty without one."""
    if most is None:
        return ""
    verdict = "met" if row["value"] <= most else "**missed**"
    return f"{measured_tables.number(most)} {row['unit']}, {verdict}"
