"""Latency of a cheap pose beside ten clients that send costly requests, against its latency alone.

.venv/bin/python benchmarks/neighbours.py MODEL.onnx
The service runs with one worker on one core; the clients share the other cores.
"""

import http.client
import json
import multiprocessing
import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing.synchronize import Event
from pathlib import Path
from statistics import median
from threading import Thread

import serve_process
from rows import Row, table

from posefield.model_file.model_card import ModelCard
from posefield.registry import model_registry

CLIENTS, ROUNDS, POSES = 10, 5, 20
PAUSE = 0.02
"""Seconds between two cheap poses, which a client draws one after the other."""
GOAL = 5.0
HEADERS = {"Content-Type": "application/json"}

Question = tuple[str, str, bytes]
"""Method, path and body of a request."""


def questions(name: str, card: ModelCard) -> dict[str, Question]:
    """Return the costly requests by what they are."""
    controls = {control.name: control.default for control in card.controls}
    across, along = (control.name for control in card.controls[:2])
    end = card.durations[0]
    targets = [
        {"joint": "RightHand", "time": end * number / 32, "position": [(-1) ** number, 1.0, 1.0]}
        for number in range(32)
    ]
    # Of few digits: a body for poses has 64 kB.
    times = ",".join(f"{end * number / 10_000:.3f}" for number in range(10_000))
    path = f"/v1/models/{name}"
    grid = f"{path}/sigma.json?across={across}&along={along}&columns=256&rows=256"
    return {
        "grids of sigma, 256 x 256": ("GET", grid, b""),
        "clips with 32 contradictory targets, open controls": (
            "POST",
            f"{path}/clip.json",
            json.dumps({"controls": {}, "targets": targets}).encode(),
        ),
        "10,000 times as JSON": (
            "POST",
            f"{path}/pose",
            f'{{"controls": {json.dumps(controls)}, "times": [{times}]}}'.encode(),
        ),
    }


def rows(path: Path) -> list[Row]:
    """Return the factor by which each costly request slows a cheap pose down."""
    ((name, model),) = model_registry.load([path]).models.items()
    card = model.session.card
    cheap = json.dumps({"controls": {c.name: c.default for c in card.controls}, "times": [0.0]})
    question = "POST", f"/v1/models/{name}/pose", cheap.encode()
    with serve_process.posefield(path, POSEFIELD_WORKERS="1", POSEFIELD_LOG="off") as server:
        return [
            _row(server.url, question, *arguments) for arguments in questions(name, card).items()
        ]


def _row(url: str, cheap: Question, name: str, costly: Question) -> Row:
    alone: list[float] = []
    latencies: list[float] = []
    for _ in range(ROUNDS):
        alone += _latencies(url, cheap)
        with _clients(url, costly):
            latencies += _latencies(url, cheap)
    baseline = f"alone: {1e3 * median(alone):.2f} ms; worst beside: {1e3 * max(latencies):.0f} ms"
    note = f"cheap pose beside {CLIENTS} clients: {name}"
    factor = median(latencies) / median(alone)
    print(note, f"{1e3 * median(latencies):.2f} ms, {factor:.1f} times;", baseline, flush=True)
    return Row(f"{note}, times its latency alone", factor, "", baseline, None, GOAL)


def _latencies(url: str, question: Question) -> list[float]:
    wire = http.client.HTTPConnection(url.removeprefix("http://"), timeout=60)
    latencies = []
    for _ in range(POSES):
        start = time.perf_counter()
        _answer(wire, question)
        latencies.append(time.perf_counter() - start)
        time.sleep(PAUSE)
    return latencies


def _answer(wire: http.client.HTTPConnection, question: Question) -> int:
    method, path, body = question
    wire.request(method, path, body, HEADERS)
    answer = wire.getresponse()
    while answer.read(1 << 20):
        pass
    return answer.status


@contextmanager
def _clients(url: str, question: Question) -> Iterator[None]:
    context = multiprocessing.get_context("spawn")
    end, started = context.Event(), context.Event()
    child = context.Process(target=ask_on, args=(url, question, started, end))
    child.start()
    try:
        started.wait(60)
        time.sleep(1.0)
        yield
    finally:
        end.set()
        child.join()


def ask_on(url: str, question: Question, started: Event, end: Event) -> None:
    """Send a request from each of CLIENTS threads, again and again, until told to end."""
    os.nice(5)

    def ask() -> None:
        wire = http.client.HTTPConnection(url.removeprefix("http://"), timeout=120)
        while not end.is_set():
            status = _answer(wire, question)
            if status != 200 and status != 503:
                raise RuntimeError(f"{question[1]}: {status}")

    threads = [Thread(target=ask) for _ in range(CLIENTS)]
    for thread in threads:
        thread.start()
    started.set()
    for thread in threads:
        thread.join()


if __name__ == "__main__":
    print(table(rows(Path(sys.argv[1]))))
