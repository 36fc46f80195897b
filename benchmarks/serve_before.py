"""Processor time of requests beside the service of another commit, in turn, in one run.

    .venv/bin/python benchmarks/serve_before.py CHECKOUT [--rounds 7] [--record]

CHECKOUT is a folder with the other commit, whose code is run with the libraries of this one. With
--record it writes docs/results/speed/before.json; run docs/generate.py afterwards. Needs wrk.
"""

import argparse
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import httpx
from rows import Row, record, table
from serve import ALONE, MANY, QUESTIONS, TOGETHER, crowd_body, get_requests, points
from serve_load import Cost, Load, in_turn, post
from serve_process import POSEFIELD, Server, free_port, started

from posefield.encode.character import METRES
from posefield.encode.formats import CLIP_ENCODERS, CROWD_ENCODERS
from posefield.http import crowd_operations
from posefield.inference import session
from posefield.question.motion_question import ClipQuestion
from posefield.synthesis import clips, crowd_synthesis
from posefield.synthesis.synthesizer import Synthesizer

ROOT = Path(__file__).parents[1]
MODEL = ROOT / "build/models/reaching.onnx"
QUIET, GOAL, WISH = 1_330.0, 1_650.0, 2_000.0
"""Clips as usdc a second and core: recorded on a quiet machine before, the goal and the wish."""
BINARY = {"msgpack": "MessagePack", "arrow": "Arrow", "npz": "npz"}
WARM = 150
"""Clips that are asked for first: usd-core writes the first two of each number of frames."""


def rows(checkout: Path, rounds: int) -> list[Row]:
    """Clips and crowds over HTTP against the other commit, and parts of their time."""
    model = Synthesizer("reaching", session.load(MODEL))
    path = f"/v1/models/{MODEL.stem}"
    controls = model.session.card.controls
    many = points(controls, QUESTIONS)
    bodies = [crowd_body(points(controls, MANY), shift) for shift in range(20)]
    loads = {
        "usdc": Load(get_requests(f"{path}/clip.usdc", many), TOGETHER),
        "usdc alone": Load(get_requests(f"{path}/clip.usdc", many), ALONE),
        "JSON alone": Load(get_requests(f"{path}/clip.json", many), ALONE),
        **{
            name: Load(tuple(post(f"{path}/crowd.{name}", body) for body in bodies), ALONE)
            for name in ("json", *BINARY)
        },
    }
    with _serving("before", checkout) as other, _serving("after", ROOT) as ours:
        for server in (other, ours):
            _warm(server, path, many[:WARM])
        runs = [(server, load) for load in loads.values() for server in (other, ours)]
        costs = in_turn(runs, rounds)
    pairs = dict(zip(loads, zip(costs[::2], costs[1::2], strict=True), strict=True))
    before = f"commit {_commit(checkout)}"
    return [
        *_clip_rows(pairs, before),
        *_crowd_rows(pairs, _encoding_seconds(model, bodies[0]), before),
        *_together_rows(model, many),
    ]


@contextmanager
def _serving(name: str, checkout: Path) -> Iterator[Server]:
    """Serve the model by the code of a checkout."""
    port = free_port()
    environment = {"POSEFIELD_PORT": str(port), "PYTHONPATH": str(checkout / "service")}
    command: list[str | Path] = [POSEFIELD, "serve", MODEL]
    with started(name, command, port, "/readyz", environment) as server:
        yield server


def _warm(server: Server, path: str, questions: Sequence[dict[str, float]]) -> None:
    with httpx.Client(base_url=server.url, timeout=60) as client:
        for question in questions:
            client.get(f"{path}/clip.usdc", params=question).raise_for_status()


Pairs = dict[str, tuple[list[Cost], list[Cost]]]
"""Costs of each round before and after, by load."""


def _clip_rows(pairs: Pairs, before: str) -> list[Row]:
    ratio, words = _against(pairs["usdc"], before)
    name = f"clips as usdc, {TOGETHER} connections, all different"
    quiet = (
        f"{words}; {QUIET:,.0f} a second and core were recorded on a quiet machine, times this "
        f"ratio {QUIET * ratio:,.0f}"
    )
    value = statistics.median(cost.each for cost in pairs["usdc"][1])
    table_rows = [
        Row(f"{what}, 1 connection", _value(pairs[key]), UNIT, note, share, 0.97)
        for what, key in (("clip as usdc", "usdc alone"), ("clip as JSON", "JSON alone"))
        for share, note in [_against(pairs[key], before)]
    ]
    return [
        Row(name, value, UNIT, quiet, ratio, GOAL / QUIET),
        Row(f"{name}, the wish", value, UNIT, quiet, ratio, WISH / QUIET),
        *table_rows,
    ]


UNIT = "µs of processor time"


def _crowd_rows(pairs: Pairs, encoding: dict[str, float], before: str) -> list[Row]:
    """Return the crowds as JSON and as binary, and what a binary encoder without cost would give.

    encoding: processor time of each format's encoder alone, s.
    """
    ratio, words = _against(pairs["json"], before)
    table_rows = [
        Row(f"crowd of {MANY} poses as JSON", _value(pairs["json"]), UNIT, words, ratio, 0.97)
    ]
    for name, title in BINARY.items():
        costs, json = pairs[name][1], pairs["json"][1]
        ratios = [b.each / a.each for a, b in zip(costs, json, strict=True)]
        rest = [cost.each - 1e6 * encoding[name] for cost in costs]
        bound = statistics.median(b.each / a for a, b in zip(rest, json, strict=True))
        note = (
            f"as JSON; rounds {min(ratios):.2f} to {max(ratios):.2f}; with an encoder that costs "
            f"nothing it would be {bound:.1f}, the rest is common to all formats"
        )
        subject = f"crowd of {MANY} poses as {title}"
        share, against = _against(pairs[name], before)
        value = _value(pairs[name])
        table_rows += [
            Row(subject, value, UNIT, note, statistics.median(ratios), 5.0),
            Row(subject, value, UNIT, against, share, None),
        ]
    return table_rows


def _together_rows(model: Synthesizer, many: Sequence[dict[str, float]]) -> list[Row]:
    """Return synthesis and encoding of clips together against one by one, in this process."""
    questions = [ClipQuestion(controls=point) for point in many[:TOGETHER]]
    encoder = CLIP_ENCODERS["usdc"]
    answers = [clips.synthesize_clip(model, question) for question in questions]
    spent = _in_turn(
        {
            "alone": lambda: [clips.synthesize_clip(model, question) for question in questions],
            "together": lambda: clips.synthesize_clips(model, questions),
            "encoded": lambda: encoder.write(answers, METRES),
        }
    )
    microseconds = {name: 1e6 * seconds / TOGETHER for name, seconds in spent.items()}
    share = microseconds["alone"] / microseconds["together"]
    note = f"one by one: {microseconds['alone']:.0f} µs"
    return [
        Row(
            f"synthesis of a clip among {TOGETHER}",
            microseconds["together"],
            UNIT,
            note,
            share,
            None,
        ),
        Row(
            f"encoding of a clip among {TOGETHER} as usdc",
            microseconds["encoded"],
            UNIT,
            "",
            None,
            None,
        ),
    ]


def _encoding_seconds(model: Synthesizer, body: bytes) -> dict[str, float]:
    poses = crowd_synthesis.synthesize_crowd(model, crowd_operations.of_body(body, MANY))
    return _in_turn({name: lambda name=name: CROWD_ENCODERS[name].encode(poses) for name in BINARY})


def _in_turn(runs: dict[str, Callable[[], object]], rounds: int = 15) -> dict[str, float]:
    """Return the median processor time of each function, s, measured alternately."""
    spent: dict[str, list[float]] = {name: [] for name in runs}
    for _ in range(rounds + 3):
        for name, run in runs.items():
            start = time.process_time()
            run()
            spent[name].append(time.process_time() - start)
    return {name: statistics.median(times[3:]) for name, times in spent.items()}


def _against(pair: tuple[list[Cost], list[Cost]], before: str) -> tuple[float, str]:
    """Return the median of the rounds' ratios of the time before, and words for the row."""
    ratios = [a.each / b.each for a, b in zip(*pair, strict=True)]
    other = statistics.median(cost.each for cost in pair[0])
    words = f"{before}: {other:,.0f} µs; rounds {min(ratios):.2f} to {max(ratios):.2f}"
    return statistics.median(ratios), words


def _value(pair: tuple[list[Cost], list[Cost]]) -> float:
    return statistics.median(cost.each for cost in pair[1])


def _commit(checkout: Path) -> str:
    command = ["git", "-C", checkout, "rev-parse", "--short=8", "HEAD"]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()


def main() -> None:
    """Measure, print, and record if asked to."""
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("checkout", type=Path)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--record", action="store_true")
    options = parser.parse_args()
    table_rows = rows(options.checkout.resolve(), options.rounds)
    sys.stdout.write(table(table_rows) + "\n")
    if options.record:
        command = "python benchmarks/serve_before.py CHECKOUT --record"
        record({"before": table_rows}, command, ROOT / "docs/results/speed")


if __name__ == "__main__":
    main()
