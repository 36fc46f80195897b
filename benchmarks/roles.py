"""Roles of the joints of naming conventions: right, asked and wrong ones.

The tables and the figures of the first run of each held-out one are in tests/model_export/roles.
"""

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rows import compact, origin

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
    for own in skeletons.values():
        found = joint_recognition.roles_of(own.names, own.parents)
        right, wrong, missing = own.count(found)
        counts["right"] += right
        counts["wrong"] += len(wrong)
        counts["asked"] += len(missing)
    return {"table": table, "conventions": list(skeletons), "now": counts, "first": first}


def main(arguments: Sequence[str]) -> None:
    """Print the figures; write them where the documentation reads them if asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--record", action="store_true")
    given = parser.parse_args(arguments)
    first = json.loads(FIRST_RUNS.read_text(encoding="utf-8"))
    found = {
        **origin("python benchmarks/roles.py --record"),
        "tables": [measure(table, first.get(table)) for table in TABLES],
    }
    text = compact(found)
    print(text)
    if given.record:
        (ROOT / "docs/results/roles.json").write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
