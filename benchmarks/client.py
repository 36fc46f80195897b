"""Cost of a pose by posefield_client, beside httpx alone: the same URL, the same body, read into
the same arrays. The first takes keywords, builds the URL, looks in its cache, checks the response
and would retry; the second has a URL.

    .venv/bin/python benchmarks/client.py [MODEL]

Both ask the real service in turn in one run.
"""

import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path

import httpx
import serve_process
from posefield_client import Client, Pose, numbers
from posefield_client.wire import Reply
from rows import Row, table

MODEL = Path(__file__).parents[1] / "build/models/reaching.onnx"
GOAL = 1.5
ROUNDS, WARM = 3000, 200
READ = numbers.decoder(Pose)


def main() -> None:
    """Measure and print."""
    print(table(rows(Path(sys.argv[1]) if sys.argv[1:] else MODEL)))


def rows(model: Path) -> list[Row]:
    """Return the time of a pose relative to httpx alone."""
    with (
        serve_process.posefield(model) as service,
        httpx.Client() as bare,
        Client(service.url, cache_bytes=0) as uncached,
        Client(service.url) as client,
    ):
        model_client = client.model(model.stem)
        controls = {name: control.default for name, control in model_client.controls.items()}
        where = url(service.url, model.stem, controls)
        alone = uncached.model(model.stem)
        ways = {
            "bare": lambda at: _bare(bare, where(at)),
            "none kept": lambda at: alone.pose(at, **controls),
            "client": lambda at: model_client.pose(at, **controls),
        }
        took = _in_turn(ways)
    times = ", ".join(f"{name} {seconds * 1e6:.0f} us" for name, seconds in took.items())
    baseline = f"httpx alone, read alike ({times})"
    ratio = took["client"] / took["bare"]
    return [Row("a pose of the service by posefield_client", ratio, "times", baseline, None, GOAL)]


def url(address: str, model: str, controls: dict[str, float]) -> Callable[[float], str]:
    """The line that the client makes, but for the time."""
    query = "&".join(f"{name}={value!r}" for name, value in controls.items())
    start = f"{address}/v1/models/{model}/pose.msgpack?{query}&time="
    return lambda at: start + repr(at)


def _bare(http: httpx.Client, where: str) -> None:
    answer = http.get(where)
    READ(Reply(answer.status_code, answer.headers, answer.content))


def _in_turn(ways: dict[str, Callable[[float], object]]) -> dict[str, float]:
    """Median seconds of each, one after the other, each time at a moment of its own."""
    took: dict[str, list[float]] = {name: [] for name in ways}
    for turn in range(WARM + ROUNDS):
        for index, (name, call) in enumerate(ways.items()):
            at = round(1e-4 * (3 * turn + index), 4)
            began = time.perf_counter()
            call(at)
            took[name].append(time.perf_counter() - began)
    return {name: statistics.median(durations[WARM:]) for name, durations in took.items()}


if __name__ == "__main__":
    main()
