"""Clips for each second of processor time of `posefield export`, as a user runs it.

    .venv/bin/python benchmarks/export_command.py [--before FOLDER] [--clips 4000] [--record]

The command exports random control points of the shipped models to a folder, its start included, by
one process, and by two. Seconds are those of its processor time, with one thread for BLAS. FOLDER
is another checkout of the repository, such as one of an earlier commit: both are measured in turn,
and the files must be the same but for rounding, which is not compared. With --record the figures
are written to docs/results/speed/exports.json; run docs/generate.py afterwards.
"""

import argparse
import os
import resource
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from rows import Row, record, table

ROOT = Path(__file__).parents[1]


@dataclass(frozen=True)
class Case:
    """An export that is measured. goal: clips for each second of processor time."""

    name: str
    model: str
    options: tuple[str, ...]
    goal: float | None


AS_PREDICTED = ("--feet", "as_predicted")
CASES = (
    Case("reaching, a family without corrections", "reaching", (), 1500.0),
    Case("walk with exact controls, feet as predicted", "cmu_walk", AS_PREDICTED, 1000.0),
    Case("walk with exact controls and standing feet, the default", "cmu_walk", (), 1000.0),
)


def rows(clips: int, rounds: int, before: Path | None) -> list[Row]:
    """Return the rates of all cases, and their ratios to the goals and to another checkout."""
    table_rows = []
    for case in CASES:
        roots = {"now": ROOT} | ({} if before is None else {"before": before})
        timings: dict[str, list[float]] = {name: [] for name in (*roots, "two")}
        for _ in range(rounds):
            for name, root in roots.items():
                timings[name].append(seconds(case, root, clips, 1))
            timings["two"].append(seconds(case, ROOT, clips, 2))
        rates = {name: clips / median(durations) for name, durations in timings.items()}
        table_rows += _case_rows(case, clips, rates)
    return table_rows


def _case_rows(case: Case, clips: int, rates: dict[str, float]) -> list[Row]:
    name = f"export of {clips:,} clips to a folder, start included: {case.name}"
    unit, rate = "clips for each CPU second", rates["now"]
    goal = f"{case.goal:,.0f} for each CPU second"
    table_rows = [Row(name, rate, unit, goal, rate / case.goal, 1.0)]
    if "before" in rates:
        earlier = f"the commit before: {rates['before']:,.0f}"
        table_rows.append(Row(name, rate, unit, earlier, rate / rates["before"], None))
    two = f"{name}, by two processes"
    # Two processes take as much time as one where each takes no more for a clip.
    table_rows.append(Row(two, rates["two"], unit, "one process", rates["two"] / rate, 0.85))
    return table_rows


def seconds(case: Case, root: Path, clips: int, workers: int) -> float:
    """Return the processor time of an export by a checkout, s, of all of its processes."""
    service = root / "service"
    model = service / "posefield/shipped" / f"{case.model}.onnx"
    environment = {
        "OPENBLAS_NUM_THREADS": "1",
        "ORT_DISABLE_TELEMETRY": "1",
        "PYTHONPATH": str(service),
    }
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "posefield", "export", str(model)]
        options = ["-o", f"{folder}/clips", "--sample", str(clips), "--workers", str(workers)]
        start = _children()
        subprocess.run(
            [*command, *options, *case.options],
            check=True,
            capture_output=True,
            env=os.environ | environment,
            cwd=folder,
        )
        return _children() - start


def _children() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--before", type=Path)
    parser.add_argument("--clips", type=int, default=4000)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--record", action="store_true")
    options = parser.parse_args()
    table_rows = rows(options.clips, options.rounds, options.before)
    print(table(table_rows))
    if options.record:
        command = "python benchmarks/export_command.py --before FOLDER --record"
        record({"exports": table_rows}, command, ROOT / "docs/results/speed")


if __name__ == "__main__":
    main()
