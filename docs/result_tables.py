"""Tables of results by the name that a file of docs/results refers to them by."""

from collections.abc import Callable

import equal_tables
import evaluation_tables as tables
from evaluation_tables import Rows, known_performer, new_performer

TABLES: dict[str, Callable[[], tuple[list[str], Rows]]] = {
    "equal_known": lambda: (equal_tables.BEST_COLUMNS, equal_tables.best("known")),
    "equal_open": lambda: (equal_tables.BEST_COLUMNS, equal_tables.best("open")),
    "pooled_known": lambda: (equal_tables.POOLED_COLUMNS, equal_tables.pooled("known")),
    "pooled_open": lambda: (equal_tables.POOLED_COLUMNS, equal_tables.pooled("open")),
    "calibration": lambda: (
        [*tables.headings("measure", known_performer), equal_tables.CALIBRATION_GOAL],
        equal_tables.calibration(),
    ),
    "clips": lambda: (
        tables.headings("method", known_performer),
        tables.errors(known_performer),
    ),
    "clips_open": lambda: (
        tables.headings("method", known_performer),
        tables.errors(known_performer, is_open=True),
    ),
    "performers": lambda: (
        tables.headings("method", new_performer),
        tables.errors(new_performer),
    ),
    "adapted": lambda: (
        ["clips given to `posefield adapt`", *tables.adapted_families()],
        tables.adapted(),
    ),
    "exact": lambda: (
        [*tables.headings("target at the event", known_performer), tables.GOALS],
        tables.exact(),
    ),
    "support": lambda: (
        ["family", "false alarms", tables.BEYOND, "in the gap"],
        tables.support(),
    ),
}
"""Columns and rows of each table."""

REMARKS: dict[str, Callable[[], str]] = {
    "equal_known": lambda: equal_tables.counts("known"),
    "equal_open": lambda: equal_tables.counts("open"),
}
"""A sentence made of the rows of a table, for some of them."""
