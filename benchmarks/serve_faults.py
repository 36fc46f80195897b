"""Mixed load on the running service, with clients and an environment that do everything wrong.

    make build/models/reaching.onnx && .venv/bin/python benchmarks/serve_faults.py [--seconds 600]

Two workers answer questions of all kinds whose right answers are known to the byte; meanwhile
clients hang up, dawdle and send rubbish, models are replaced and broken, a worker is killed, and
the service is told to end and started again. Exit code 1 where an answer was wrong, a status 5xx
was another than the documented 503, a request that was taken in was not answered, or memory grew.
"""

import argparse
import asyncio
import json
import random
import statistics
import sys
from collections import defaultdict
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic

import faults_known
from faults_book import Book
from faults_clients import CLIENTS, Site, again
from faults_scenes import MODEL_SCENES, Stage, killing, restarting
from serve_process import free_port

MODEL = Path("build/models/reaching.onnx")
LONG = 60.0
"""Seconds that a worker has to live for its memory to be judged."""
FLAT = 15.0
"""MB by which memory may differ between the second and the last quarter of a worker's life: what
allocators keep of the largest answers of several threads."""


def main() -> None:
    """Run, report, and say by the exit code whether all was well."""
    words = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    words.add_argument("model", nargs="?", type=Path, default=MODEL)
    words.add_argument("--seconds", type=float, default=600.0)
    words.add_argument("--seed", type=int, default=1)
    options = words.parse_args()
    with TemporaryDirectory() as name:
        faults = asyncio.run(
            run(Path(name), options.model.read_bytes(), options.seconds, options.seed)
        )
    print("\n".join(faults) or "no fault")
    sys.exit(bool(faults))


async def run(folder: Path, model: bytes, seconds: float, seed: int) -> list[str]:
    """Return the faults, a line each."""
    book, contents = Book(), (model, faults_known.other_version(model))
    references = await asyncio.to_thread(faults_known.of, ("reaching", "plain"), contents)
    print(f"{len(references)} questions of known answers", flush=True)
    stage = Stage(folder / "models", folder / "log", contents, free_port(), book)
    stage.lay_out()
    await stage.start()
    site, start = Site(stage.port, references, book, seed), monotonic()
    async with asyncio.TaskGroup() as group:
        group.create_task(stage.watch())
        for client, count in CLIENTS:
            for number in range(count):
                group.create_task(again(client, site, number))
        await stage.play(seconds, random.Random(seed))
        book.ended = True
    await stage.end()
    report(stage, monotonic() - start)
    return [*book.wrong, *_untried(stage), *_logged(stage.log), *_grown(stage)]


def report(stage: Stage, seconds: float) -> None:
    """Print what happened."""
    book, answered = stage.book, stage.book.right.total()
    print(f"{answered} right answers in {seconds:.0f} s: {_counts(book.right)}")
    print(f"wrong or unanswered: {len(book.wrong)}; of each version: {_counts(book.versions)}")
    print(f"documented 503: {_counts(book.refused)}; nobody listened: {book.away} times")
    print(f"{book.broken} connections were broken by killing a worker")
    print(f"to clients that broke the rules: {_counts(book.faulty)}")
    print(f"done to the service: {_counts(stage.done)}")
    for worker, life in _lives(stage).items():
        sizes = [size for _, size in life]
        print(
            f"worker {worker}: {life[-1][0] - life[0][0]:.0f} s, {sizes[0]:.0f} MB at first, "
            f"{sizes[len(sizes) // 2]:.0f} in the middle, {sizes[-1]:.0f} at last, "
            f"{max(sizes):.0f} at most"
        )


def _untried(stage: Stage) -> list[str]:
    """List the scenes, versions and statuses that did not occur."""
    scenes = [scene.__name__ for scene in (*MODEL_SCENES, killing, restarting)]
    lines = [f"{name} was not tried" for name in scenes if not stage.done[name]]
    if len(stage.book.versions) < len(stage.contents):
        lines.append("one version of the model never answered under a plain name")
    return lines + [f"{s} was never seen" for s in (200, 304, 400, 404) if not stage.book.right[s]]


def _logged(log: Path) -> list[str]:
    """Lines of the service's log that tell of a failure of its own."""
    lines = []
    for line in log.read_text().splitlines():
        if not line.startswith("{"):
            if not ("ended by SIGKILL" in line or ".onnx: " in line):
                lines.append(f"log: {line}")
        elif (status := json.loads(line)["status"]) >= 500 and status != 503:
            lines.append(f"log: {line}")
    return lines


def _grown(stage: Stage) -> list[str]:
    lines = []
    for worker, life in _lives(stage).items():
        if life[-1][0] - life[0][0] < LONG:
            continue
        quarter, sizes = len(life) // 4, [size for _, size in life]
        early, late = (
            statistics.mean(quarter_sizes)
            for quarter_sizes in (sizes[quarter : 2 * quarter], sizes[-quarter:])
        )
        if late > early + FLAT:
            lines.append(f"worker {worker} grew from {early:.0f} to {late:.0f} MB")
    return lines


def _lives(stage: Stage) -> dict[int, list[tuple[float, float]]]:
    lives = defaultdict(list)
    for when, worker, size in stage.memory:
        lives[worker].append((when, size))
    return lives


def _counts(counter: dict) -> str:
    return ", ".join(f"{name} {count}" for name, count in sorted(counter.items())) or "none"


if __name__ == "__main__":
    main()
