"""Roles of the joints of naming conventions: right, asked and wrong ones.

The tables and the figures of the first run of each held-out one are in tests/model_export/roles.
"""

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rows import Row, record, table

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests/model_export"))

import skeleton_tables  # noqa: E402

from posefield.roles import joint_recognition  # noqa: E402

TABLES = ("development", "held_out", "held_out_later", "held_out_last")
FIRST_RUNS = ROOT / "tests/model_export/roles/first_runs.json"


def measure(table: str, first: dict[str, int] | None) -> dict[str, Any]:
    """Return the conventions of a table and their counts. first: counts of its first run."""
    skeletons = skeleton_tables.read(table)
    counts = {"right": 0, "asked": 0, "wrong": 0}
    for skeleton in skeletons.values():
        recognised = joint_recognition.roles_of(skeleton.names, skeleton.parents)
        right, wrong, missing = skeleton.count(recognised)
        counts["right"] += right
        counts["wrong"] += len(wrong)
        counts["asked"] += len(missing)
    return {"table": table, "conventions": list(skeletons), "now": counts, "first": first}


def rows(measured: dict[str, Any]) -> list[Row]:
    """Return the shares of roles that are asked and wrong. Goals are those of held-out tables."""
    now, first = measured["now"], measured["first"]
    name = f"{measured['table'].replace('_', ' ')}, {len(measured['conventions'])} conventions"
    count = sum(now.values())
    comment = f"of {count} roles" + (f"; {first['asked']} in the first run" if first else "")
    wrong = f"{first['wrong']} in the first run" if first else ""
    share = 100.0 * now["asked"] / count
    return [
        Row(f"{name}: asked", share, "%", comment, None, None),
        Row(f"{name}: wrong", now["wrong"], "roles", wrong, None, 0.0 if first else None),
    ]


def held_out(counts: Sequence[dict[str, int]]) -> Row:
    """Return the share of roles of all held-out tables that are asked or wrong."""
    total = sum(sum(table.values()) for table in counts)
    right = sum(table["right"] for table in counts)
    share = 100.0 * (1.0 - right / total)
    return Row("all held out: asked or wrong", share, "%", f"of {total} roles", None, 5.0)


def main(arguments: Sequence[str]) -> None:
    """Print the figures; write them where the documentation reads them if asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--record", action="store_true")
    options = parser.parse_args(arguments)
    first = json.loads(FIRST_RUNS.read_text(encoding="utf-8"))
    measured = [measure(name, first.get(name)) for name in TABLES]
    table_rows = [row for counts in measured for row in rows(counts)]
    table_rows.append(held_out([counts["now"] for counts in measured if counts["first"]]))
    print(table(table_rows))
    if options.record:
        record({"roles": table_rows}, "python benchmarks/roles.py --record", ROOT / "docs/results")


if __name__ == "__main__":
    main(sys.argv[1:])
