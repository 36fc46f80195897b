"""Rows of the benchmark's table."""

import json
import platform
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path

WIDTH = 400
"""Characters of a line of a file of results: a row of a table is one line."""


@dataclass(frozen=True)
class Row:
    """One figure: value in unit, None if it is not measured yet; ratio to the baseline; goal for
    the ratio, or for the value where there is no ratio, met upwards for ratios and downwards for
    values."""

    name: str
    value: float | None
    unit: str
    baseline: str
    ratio: float | None
    goal: float | None

    @property
    def met(self) -> bool | None:
        """Return whether the goal is met; None without a goal or a value."""
        if self.goal is None or self.value is None:
            return None
        # Numbers may be NumPy's, whose comparisons JSON does not know.
        return bool(self.value <= self.goal if self.ratio is None else self.ratio >= self.goal)


def table(rows: list[Row]) -> str:
    """The rows as a Markdown table."""
    lines = ["| what | value | against | ratio | goal | met |", "|---|---|---|---|---|---|"]
    for row in rows:
        ratio = "" if row.ratio is None else f"{row.ratio:.1f}"
        goal = "" if row.goal is None else f"{row.goal:g}"
        met = {True: "yes", False: "**no**", None: ""}[row.met]
        value = "" if row.value is None else f"{row.value:.3g} {row.unit}"
        lines.append(f"| {row.name} | {value} | {row.baseline} | {ratio} | {goal} | {met} |")
    return "\n".join(lines)


def write(rows: list[Row], path: Path) -> None:
    """The rows as JSON: a list of objects."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(_plain(rows), indent=2) + "\n")


def record(tables: Mapping[str, list[Row]], command: str, folder: Path, device: str = "") -> None:
    """Write the rows of tables of the documentation, a file NAME.json each, with their origin.

    device: that computed, if it is not the machine's processor.
    """
    for name, rows in tables.items():
        recorded = {**origin(command, device), "rows": _plain(rows)}
        (folder / f"{name}.json").write_text(compact(recorded) + "\n", encoding="utf-8")


def compact(value: object, indent: int = 0) -> str:
    """Return JSON in which an object or list that fits in WIDTH characters is one line."""
    line = json.dumps(value, ensure_ascii=False)
    if len(line) <= WIDTH or not isinstance(value, dict | list):
        return line
    items = (
        [f"{json.dumps(key)}: {compact(item, indent + 1)}" for key, item in value.items()]
        if isinstance(value, dict)
        else [compact(item, indent + 1) for item in value]
    )
    start, end = "{}" if isinstance(value, dict) else "[]"
    lines = ",\n".join(" " * (indent + 1) + item for item in items)
    return f"{start}\n{lines}\n{' ' * indent}{end}"


def origin(command: str, device: str = "") -> dict[str, str]:
    """Return the command, the date and the machine of figures that are measured now."""
    facts = platform.machine(), platform.system(), f"Python {platform.python_version()}", device
    machine = ", ".join(filter(None, facts))
    return {"command": command, "date": f"{datetime.now(UTC):%Y-%m-%d}", "machine": machine}


def _plain(rows: list[Row]) -> list[dict[str, object]]:
    return [{**asdict(row), "met": row.met} for row in rows]
