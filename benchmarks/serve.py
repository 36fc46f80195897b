"""Cost of requests to the service, beside a handler that does nothing but run the model.

    make build/models/reaching.onnx && .venv/bin/python benchmarks/serve.py [MODEL]

Each server has the first core for itself, and wrk the last. The cost is processor time, which
neighbours of the machine change least; it is taken in turn, round by round, and a ratio is the
median of the rounds' own. No two questions of a load are the same.
"""

import statistics
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from urllib.parse import urlencode

import httpx
import numpy as np
import orjson
from rows import Row, table
from serve_load import Cost, Load, get, in_turn, post, run
from serve_process import Server, bare, posefield

from posefield.inference import session
from posefield.model_file.model_card import Control

MODEL = Path("build/models/reaching.onnx")
ROUNDS = 7
QUESTIONS, MANY = 10_000, 500
ALONE, TOGETHER, PACED = 1, 32, 64
HEAD = 1000
"""More bytes than an answer without a body has, and fewer than a pose."""
# Sums of float32 in another order.
CLOSE = 1e-5

Numbers = dict[str, float]


def rows(model: Path, rounds: int = ROUNDS) -> list[Row]:
    """Poses, answers that clients have already, clips, crowds, and how long requests wait."""
    controls = session.load(model).card.controls
    path = f"/v1/models/{model.stem}"
    with posefield(model) as ours, bare(model) as other:
        _check(ours, other, path, controls)
        return [
            *_poses(ours, other, path, controls, rounds),
            *_files(ours, path, controls, rounds),
            *_crowds(ours, path, controls, rounds),
            *_waits(ours, path, controls, rounds),
        ]


def points(controls: Sequence[Control], count: int) -> list[Numbers]:
    """Control values at random, anywhere in what was sampled, and always the same."""
    rng = np.random.default_rng(1)
    limits = np.array([(c.minimum, c.maximum) for c in controls])
    # Four digits: what people write, and what bodies of usual length have.
    values = rng.uniform(*limits.T, (count, len(limits))).round(4)
    inside = np.clip(values, *limits.T)
    return [dict(zip((c.name for c in controls), row, strict=True)) for row in inside.tolist()]


def pose_questions(controls: Sequence[Control], count: int = QUESTIONS) -> list[Numbers]:
    """Control values and a time."""
    times = np.random.default_rng(2).uniform(0, 1, count).round(4).tolist()
    requests = zip(points(controls, count), times, strict=True)
    return [{**point, "time": when} for point, when in requests]


def _check(ours: Server, other: Server, path: str, controls: Sequence[Control]) -> None:
    """Both answer alike: otherwise nothing can be compared."""
    for question in pose_questions(controls, 20):
        plain = {"Accept-Encoding": "identity"}
        urls = ours.url + path + "/pose", other.url
        answer = [httpx.get(url, params=question, headers=plain).json() for url in urls]
        assert list(answer[0]) == list(answer[1])
        for name in ("rotations", "root_position", "bone_offsets"):
            np.testing.assert_allclose(answer[0][name], answer[1][name], atol=CLOSE)


def _poses(
    ours: Server, other: Server, path: str, controls: Sequence[Control], rounds: int
) -> list[Row]:
    questions = pose_questions(controls)
    requests = get_requests(f"{path}/pose", questions)
    tags = _asked_again(ours, f"{path}/pose", questions[:2000])
    plain = get_requests("/", questions)
    # Beside each other in time what is compared: neighbours come and go.
    runs = [
        (ours, Load(requests, ALONE)),
        (other, Load(plain, ALONE)),
        (ours, Load(tags, ALONE)),
        (ours, Load(get_requests(f"{path}/pose.msgpack", questions), ALONE)),
        (ours, Load(requests, TOGETHER)),
        (other, Load(plain, TOGETHER)),
        (ours, Load(tags, TOGETHER)),
    ]
    alone, base, kept_alive, packed, many, base_many, held_many = in_turn(runs, rounds)
    return [
        _share("pose, 1 connection", alone, base, 1.8),
        _share(f"pose, {TOGETHER} connections", many, base_many, 1.4),
        _share("pose as MessagePack, 1 connection", packed, base, None),
        _gain("304, 1 connection", kept_alive, base),
        _gain(f"304, {TOGETHER} connections", held_many, base_many),
    ]


def _files(ours: Server, path: str, controls: Sequence[Control], rounds: int) -> list[Row]:
    usdc, json = (
        get_requests(f"{path}/clip.{e}", points(controls, QUESTIONS)) for e in ("usdc", "json")
    )
    goal = "500 µs: 2,000 a second on one core"
    formats = {
        f"clip as usdc, {TOGETHER} connections": (Load(usdc, TOGETHER), goal, 500.0),
        f"one and the same, {TOGETHER} connections": (Load(usdc[:1], TOGETHER), goal, 500.0),
        "clip as usdc, 1 connection": (Load(usdc, ALONE), "", None),
        "clip as JSON, 1 connection": (Load(json, ALONE), "", None),
    }
    costs = in_turn([(ours, load) for load, _, _ in formats.values()], rounds)
    return [
        _cost(name, format_costs, words, largest)
        for (name, (_, words, largest)), format_costs in zip(formats.items(), costs, strict=True)
    ]


def _crowds(ours: Server, path: str, controls: Sequence[Control], rounds: int) -> list[Row]:
    bodies = [crowd_body(points(controls, MANY), shift) for shift in range(20)]
    names = ("json", "arrow", "msgpack", "npz")
    runs = [
        (ours, Load(tuple(post(f"{path}/crowd.{name}", body) for body in bodies), ALONE))
        for name in names
    ]
    costs = dict(zip(names, in_turn(runs, rounds), strict=True))
    json = costs.pop("json")
    return [_crowd_row(name, cost, json) for name, cost in costs.items()]


def _crowd_row(name: str, format_costs: Sequence[Cost], json: Sequence[Cost]) -> Row:
    ratios = [b.each / a.each for a, b in zip(format_costs, json, strict=True)]
    value, other = (_best(cost.each for cost in costs) / 1e3 for costs in (format_costs, json))
    words = f"the same as JSON: {other:.2f} ms; rounds {_range(ratios)}"
    title, unit = f"crowd of {MANY} poses as {name}", "ms of processor time"
    return Row(title, value, unit, words, statistics.median(ratios), 5.0)


def _waits(ours: Server, path: str, controls: Sequence[Control], rounds: int) -> list[Row]:
    """Latencies at half of the rate that saturates: many connections that each ask seldom."""
    requests = get_requests(f"{path}/pose", pose_questions(controls))
    table_rows = []
    for _ in range(rounds):
        largest = run(ours, Load(requests, TOGETHER)).rate
        paced = Load(requests, PACED, think=1e3 * PACED / (largest / 2))
        table_rows.append((largest, run(ours, paced)))
    ratios = [cost.p99 / cost.median for _, cost in table_rows]
    largest, cost = sorted(table_rows, key=lambda one: one[1].p99 / one[1].median)[
        len(table_rows) // 2
    ]
    words = (
        f"p50 {1e3 * cost.median:.2f} ms, p99 {1e3 * cost.p99:.2f} ms at {cost.rate:.0f} requests "
        f"a second of {largest:.0f}; rounds {_range(ratios)}"
    )
    return [Row("p99 of p50 at half the load", statistics.median(ratios), "×", words, None, 5.0)]


def get_requests(target: str, questions: Iterable[Numbers]) -> tuple[bytes, ...]:
    return tuple(get(f"{target}?{urlencode(question)}") for question in questions)


def _asked_again(ours: Server, target: str, questions: Sequence[Numbers]) -> tuple[bytes, ...]:
    """The questions with the tags of their answers."""
    table_rows = []
    with httpx.Client(base_url=ours.url) as client:
        # An answer's tag hangs on these, and wrk sends neither.
        del client.headers["accept"], client.headers["accept-encoding"]
        for question in questions:
            line = f"{target}?{urlencode(question)}"
            table_rows.append(get(line, f"If-None-Match: {client.get(line).headers['etag']}"))
    assert run(ours, Load(tuple(table_rows), ALONE, 1.0)).size < HEAD
    return tuple(table_rows)


def crowd_body(points: Sequence[Numbers], shift: int) -> bytes:
    columns = {name: [point[name] for point in points] for name in points[0]}
    distances = [round(0.001 * (shift + i), 4) for i in range(len(points))]
    positions = [[float(i % 25), 0.0, float(i // 25)] for i in range(len(points))]
    return orjson.dumps({"controls": columns, "time": distances, "position": positions})


def _share(name: str, costs: Sequence[Cost], base: Sequence[Cost], goal: float | None) -> Row:
    """Processor time as a multiple of the bare handler's: at most the goal."""
    ratios = [a.each / b.each for a, b in zip(costs, base, strict=True)]
    return Row(name, statistics.median(ratios), "×", _words(costs, base, ratios), None, goal)


def _gain(name: str, costs: Sequence[Cost], base: Sequence[Cost]) -> Row:
    """Return the bare handler's processor time of a 200 as a multiple: at least 1."""
    ratios = [b.each / a.each for a, b in zip(costs, base, strict=True)]
    value = _best(cost.each for cost in costs)
    return Row(name, value, "µs", _words(costs, base, ratios), statistics.median(ratios), 1.0)


def _words(costs: Sequence[Cost], base: Sequence[Cost], ratios: Sequence[float]) -> str:
    best, other = _best(c.each for c in costs), _best(c.each for c in base)
    return (
        f"processor time of the bare handler; rounds {_range(ratios)}; least {best:.0f} of "
        f"{other:.0f} µs; at most {_most(costs)} of {_most(base)} requests a second"
    )


def _cost(name: str, costs: Sequence[Cost], words: str, goal: float | None) -> Row:
    durations = [cost.each for cost in costs]
    note = "; ".join(
        word
        for word in (words, f"rounds {_range(durations, 0)}", f"{_most(costs)} a second")
        if word
    )
    return Row(name, statistics.median(durations), "µs of processor time", note, None, goal)


def _best(values: Iterable[float]) -> float:
    return min(values)


def _most(costs: Sequence[Cost]) -> str:
    return f"{max(cost.rate for cost in costs):.0f}"


def _range(values: Sequence[float], digits: int = 2) -> str:
    return f"{min(values):.{digits}f} to {max(values):.{digits}f}"


if __name__ == "__main__":
    print(table(rows(Path(sys.argv[1]) if sys.argv[1:] else MODEL)))
