"""Tables of results by the name that a file of docs/results refers to them by."""

from collections.abc import Callable

import equal_tables
import evaluation_tables as tables
import measured_tables
from evaluation_tables import Rows, known_performer, new_performer

SPEED_FILES = (
    "training",
    "graph",
    "requests",
    "before",
    "crowds",
    "files",
    "layers",
    "exports",
)
SPEED = tuple(f"speed/{name}" for name in SPEED_FILES)
JUDGED = (
    "performed",
    "tracks",
    "track_costs",
    "track_parts",
    "joins",
    "joint_angles",
    "target_frames",
    "discovered",
    "found_families",
    "found_models",
    "proposed_controls",
    "robot_faults",
    "robot_gaits",
    "roles",
    "scaled",
    "strides",
)
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
    "performers": lambda: (
        tables.headings("method", new_performer),
        tables.errors(new_performer),
    ),
    "adapted": lambda: (
        ["clips given to `posefield adapt`", *tables.adapted_families()],
        tables.adapted(),
    ),
    "feet": lambda: (
        ["measure", *(tables.ALL_FAMILIES[own] for own in tables.feet_families()), tables.GOALS],
        tables.feet(),
    ),
    "takes": lambda: (
        [
            "measure",
            *(tables.ALL_FAMILIES[own] for own in tables.take_families()),
            tables.GOALS,
        ],
        tables.takes(),
    ),
    "exact": lambda: (
        [*tables.headings("target at the event", known_performer), tables.GOALS],
        tables.exact(),
    ),
    "support": lambda: (
        ["family", "false alarms", tables.BEYOND],
        tables.support(),
    ),
    "stride_speeds": lambda: (measured_tables.STRIDE_COLUMNS, measured_tables.stride_speeds()),
    "robots_tenths": lambda: (measured_tables.GAIT_COLUMNS, measured_tables.gaits("tenths")),
    "robots_grid": lambda: (measured_tables.GAIT_COLUMNS, measured_tables.gaits("grid")),
    "robots_measured": lambda: (
        measured_tables.GAIT_COLUMNS,
        measured_tables.gaits("measured tenths"),
    ),
    "recipes": lambda: (measured_tables.RECIPE_COLUMNS, measured_tables.recipes()),
    "levels": lambda: (measured_tables.LEVEL_COLUMNS, measured_tables.levels()),
    **{
        name: lambda name=name: (measured_tables.JUDGED_COLUMNS, measured_tables.judged(name))
        for name in JUDGED
    },
    **{
        name: lambda name=name: (measured_tables.SPEED_COLUMNS, measured_tables.speed(name))
        for name in SPEED
    },
}
"""Columns and rows of each table."""

REMARKS: dict[str, Callable[[], str]] = {
    "equal_known": lambda: equal_tables.counts("known"),
    "equal_open": lambda: equal_tables.counts("open"),
}
"""A sentence made of the rows of a table, for some of them."""

ORIGINS: dict[str, str] = {name: name for name in (*SPEED, *JUDGED)} | {
    "robots_tenths": "robot_gaits",
    "robots_grid": "robot_gaits",
    "robots_measured": "robot_gaits",
    "recipes": "models",
    "levels": "models",
    "stride_speeds": "strides",
}
"""File of docs/results that names the command and the date of a table's figures."""
