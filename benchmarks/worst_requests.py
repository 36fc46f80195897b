"""CPU time and memory of the worst legal request of each operation.

.venv/bin/python benchmarks/worst_requests.py REACHING.onnx WALK.onnx
Each request is sent alone to a service of one worker with its usual limits, started for it. Writes
docs/results/worst-requests.md and build/worst-requests.json.
"""

import contextlib
import http.client
import json
import os
import sys
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from threading import Event, Thread

import serve_process
import worst_questions
from serve_process import Server
from worst_questions import Question

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / "docs/results/worst-requests.md"
CANDIDATES = ROOT / "build/worst-requests.json"
ENVIRONMENT = {"POSEFIELD_WORKERS": "1", "POSEFIELD_LOG": "off", "POSEFIELD_DEADLINE": "3600"}
MB, LIMIT = 1e6, 700.0
"""Bytes, and the most megabytes that a process may take."""
LOOK = 0.02
IDLE = 0.3
"""Seconds in which a service that has stopped takes no more than a hundredth of CPU time."""


@dataclass(frozen=True)
class Cost:
    """Cost of a request: seconds of CPU time and peak megabytes of the service's process and of
    the largest that it started.

    late: seconds of CPU time that the same request takes once no client waits for it, until the
    service is idle: after a 503 to `Prefer: wait=1` or, where the answer begins before, after the
    client has closed its connection a second later. None for requests that take a second at most.
    """

    operation: str
    question: str
    status: int
    answer: float
    seconds: float
    memory: float
    child: float
    late: float | None


def measured(question: Question) -> Cost:
    """Return the cost of one request."""
    with serve_process.posefield(question.model, **ENVIRONMENT) as server:
        before = _processor(server.process)
        with _watched(server) as peaks:
            status, size = _answer(server, question)
        seconds = _processor(server.process) - before
    late = _late(question) if seconds > 1.0 else None
    return Cost(
        question.operation,
        question.note,
        status,
        size / MB,
        seconds,
        peaks.get(server.process, 0.0),
        max((peak for process, peak in peaks.items() if process != server.process), default=0.0),
        late,
    )


def _late(question: Question) -> float:
    """Seconds of CPU time that a request takes after a client's patience of a second."""
    with serve_process.posefield(question.model, **ENVIRONMENT) as server:
        wire = _sent(server, question, {"Prefer": "wait=1"})
        if wire.getresponse().status != 503:
            time.sleep(1.0)
        wire.close()
        first = last = _all_processes(server)
        while True:
            time.sleep(IDLE)
            now = _all_processes(server)
            if now - last <= 0.01:
                return last - first
            last = now


def _answer(server: Server, question: Question) -> tuple[int, int]:
    """Status of an answer, and its bytes."""
    wire = _sent(server, question, {})
    answer = wire.getresponse()
    size = 0
    with contextlib.suppress(http.client.IncompleteRead):
        while piece := answer.read(1 << 20):
            size += len(piece)
    wire.close()
    return answer.status, size


def _sent(
    server: Server, question: Question, headers: dict[str, str]
) -> http.client.HTTPConnection:
    """Connection over which a request has been sent."""
    wire = http.client.HTTPConnection(server.url.removeprefix("http://"), timeout=3600)
    body = {"Content-Type": "application/json"} | headers
    wire.request("POST" if question.body else "GET", question.path, question.body, body)
    return wire


@contextlib.contextmanager
def _watched(server: Server) -> Iterator[dict[int, float]]:
    """Peak megabytes of a server and of each process that it starts within the block."""
    peaks: dict[int, float] = {}
    done = Event()

    def look() -> None:
        while not done.is_set():
            for process in (server.process, *serve_process.children(server.process)):
                peaks[process] = max(peaks.get(process, 0.0), _peak(process))
            time.sleep(LOOK)

    thread = Thread(target=look)
    thread.start()
    try:
        yield peaks
    finally:
        done.set()
        thread.join()
        peaks[server.process] = _peak(server.process)


def _processor(process: int) -> float:
    """Seconds of CPU time of a process and of all that it started and that have ended."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK")


def _all_processes(server: Server) -> float:
    """The same of those that still run, too: they are counted once they have ended."""
    running = serve_process.children(server.process)
    return _processor(server.process) + sum(map(_processor, running))


def _peak(process: int) -> float:
    try:
        lines = Path(f"/proc/{process}/status").read_text().splitlines()
    except OSError:
        return 0.0
    peaks = [line.split()[1] for line in lines if line.startswith("VmHWM:")]
    return int(peaks[0]) * 1024 / MB if peaks else 0.0


def table(costs: list[Cost]) -> str:
    """The costs as a Markdown table, the worst request of each operation by CPU and by memory."""
    lines = [
        "| operation | request | status | answer, MB | CPU, s | peak, MB | child's peak, MB | "
        "CPU after a late answer, s |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for cost in costs:
        late = "" if cost.late is None else f"{cost.late:.2f}"
        child = f"{cost.child:.0f}" if cost.child else ""
        lines.append(
            f"| {cost.operation} | {cost.question} | {cost.status} | {cost.answer:.1f} | "
            f"{cost.seconds:.2f} | {cost.memory:.0f} | {child} | {late} |"
        )
    return "\n".join(lines)


def worst(costs: list[Cost]) -> list[Cost]:
    """The costs that are the most of their operation, in CPU time or in memory of a process."""
    table_rows = []
    for operation in dict.fromkeys(cost.operation for cost in costs):
        operation_costs = [cost for cost in costs if cost.operation == operation]
        slowest = max(operation_costs, key=lambda cost: cost.seconds)
        largest = max(operation_costs, key=lambda cost: max(cost.memory, cost.child))
        table_rows += [slowest] if slowest is largest else [slowest, largest]
    return table_rows


def main(reaching: Path, walk: Path) -> None:
    """Measure all candidates and write the results."""
    costs = []
    for question in worst_questions.of(reaching, walk):
        cost = measured(question)
        print(table([cost]).splitlines()[-1], flush=True)
        costs.append(cost)
        _write(costs)
    peak = max(max(cost.memory, cost.child) for cost in costs)
    sys.exit(f"{peak:.0f} MB, expected at most {LIMIT:.0f}" if peak > LIMIT else 0)


def _write(costs: list[Cost]) -> None:
    CANDIDATES.parent.mkdir(parents=True, exist_ok=True)
    note = (__doc__ or "").partition("\n")[0]
    head = f"# {note}\n\nWorst of {len(costs)} candidates, by `benchmarks/worst_requests.py`."
    RESULTS.write_text(f"{head}\n\n{table(worst(costs))}\n")
    listed = json.dumps([asdict(cost) for cost in costs], indent=1)
    CANDIDATES.write_text(listed + "\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
