"""The graph against naive kriging, and crowds beside commit fa93c04, in one run.

    .venv/bin/python benchmarks/graph.py [CHECKOUT] [--record]

CHECKOUT is a folder with commit fa93c04, whose code trains and runs a model of its own with the
libraries of this one; without it crowds are timed alone. With --record it writes
docs/results/speed/graph.json; run docs/generate.py afterwards.
"""

import os

os.environ["ORT_DISABLE_TELEMETRY"] = "1"

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from statistics import median

import crowd_scene
import family
import runtime
from crowd_scene import AUTO
from rows import Row, record, table

from posefield.inference import session
from posefield.synthesis.synthesizer import Synthesizer

ROOT = Path(__file__).parents[1]
MODEL = ROOT / "build/models/reaching.onnx"
MANY, ROUNDS, REPEATS = 10_000, 9, 5
FASTER, RATIO = 2.5, 2.0
"""Goals: processor time of the earlier commit over ours, and finest over coarsest."""
EARLIER = """
import json, sys, time
sys.path[:0] = [sys.argv[1], sys.argv[1] + "/benchmarks"]
from pathlib import Path
import crowd_scene
from model_export.evaluate import table1_family
from service.synthesis import session
from service.synthesis.synthesizer import Synthesizer
path = Path(sys.argv[2], "reaching.onnx")
if not path.exists():
    path.write_bytes(table1_family.make(Path(sys.argv[2], "family")).exported.content)
model = Synthesizer("reaching", session.load(path))
scene = crowd_scene.around(model, int(sys.argv[3]))
runs = [scene.poses(scene.all_at(0)), scene.poses(scene.all_at(scene.coarsest)),
        scene.poses(crowd_scene.AUTO)]
for run in runs:
    run()
print("ready", flush=True)
for line in sys.stdin:
    found = []
    for run in runs:
        start = time.process_time()
        for _ in range(int(line)):
            run()
        found.append((time.process_time() - start) / int(line))
    print(json.dumps(found), flush=True)
"""
LEVELS = ("finest", "coarsest", "by view")


def crowd_rows(checkout: Path | None) -> list[Row]:
    """10,000 characters, one pose each: processor time of both threads."""
    timings = _times(checkout)
    ours = {name: median(times[i] for times in timings["ours"]) for i, name in enumerate(LEVELS)}
    ratio = ours["finest"] / ours["coarsest"]
    table_rows = []
    for index, level in enumerate(LEVELS):
        name = f"{MANY:,} characters, a pose each, processor time of the whole call, {level}"
        columns = name, 1e3 * ours[level], "ms"
        if level == "finest":
            table_rows.append(Row(*columns, "the coarsest level", ratio, RATIO))
        if checkout:
            pairs = zip(timings["earlier"], timings["ours"], strict=True)
            times = median(before[index] / after[index] for before, after in pairs)
            table_rows.append(Row(*columns, "commit fa93c04", times, FASTER))
    return table_rows


def _times(checkout: Path | None) -> dict[str, list[list[float]]]:
    """Return the seconds of rounds, of each of `LEVELS`, ours and the commit's in turn."""
    model = Synthesizer("reaching", session.load(MODEL))
    scene = crowd_scene.around(model, MANY)
    runs = [scene.poses(d) for d in (scene.all_at(0), scene.all_at(scene.coarsest), AUTO)]
    for run in runs:
        run()
    timings: dict[str, list[list[float]]] = {"ours": [], "earlier": []}
    with _earlier(checkout) if checkout else nullcontext() as other:
        for _ in range(ROUNDS):
            if other:
                timings["earlier"].append(other())
            timings["ours"].append([_seconds(run) for run in runs])
    return timings


def _seconds(run: Callable[[], object]) -> float:
    start = time.process_time()
    for _ in range(REPEATS):
        run()
    return (time.process_time() - start) / REPEATS


@contextmanager
def _earlier(checkout: Path) -> Iterator[Callable[[], list[float]]]:
    """Yield a function that times a round in a process of the earlier commit's code."""
    with tempfile.TemporaryDirectory() as folder:
        words = [sys.executable, "-c", EARLIER, str(checkout), folder, str(MANY)]
        with subprocess.Popen(
            words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        ) as process:
            sent, answers = process.stdin, process.stdout
            assert sent is not None and answers is not None
            if answers.readline() != "ready\n":
                raise RuntimeError(f"{checkout}: its code does not run, expected commit fa93c04")

            def ask() -> list[float]:
                sent.write(f"{REPEATS}\n")
                sent.flush()
                answer: list[float] = json.loads(answers.readline())
                return answer

            yield ask


def main() -> None:
    """Measure, print, and write where asked to."""
    parser = argparse.ArgumentParser()
    parser.add_argument("checkout", type=Path, nargs="?")
    parser.add_argument("--record", action="store_true")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        trained_family = family.make(Path(folder, "reaching"))
    rows = [*runtime.rows(trained_family), *crowd_rows(options.checkout)]
    rows = [row for row in rows if row.name not in ("model file", runtime.TRAINING)]
    print(table(rows))
    if options.record:
        command = "python benchmarks/graph.py CHECKOUT --record"
        record({"graph": rows}, command, ROOT / "docs/results/speed")


if __name__ == "__main__":
    main()
