"""Prints what posefield is measured by and writes build/bench.json.

    make bench

Every ratio compares two things timed in turn in this one run; a row's baseline says in words what
it is compared with. Medians, one thread inside onnxruntime.
"""

import sys
from pathlib import Path

import family
import newcomer
import precompute
import runtime
from rows import Row, table, write

ROOT = Path(__file__).parents[1]


def main() -> None:
    """Measure, print, write."""
    made = family.make(ROOT / "build/bench")
    rows: list[Row] = [
        *precompute.rows(made),
        *runtime.rows(made),
        *newcomer.rows(ROOT, from_nothing="--no-install" not in sys.argv),
    ]
    print(table(rows))
    write(rows, ROOT / "build/bench.json")


if __name__ == "__main__":
    main()
