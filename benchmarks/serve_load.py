"""Load by wrk from a core of its own on a server on another, and what each request costs that."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from serve_process import Server

SCRIPT = Path(__file__).with_name("serve_load.lua")


@dataclass(frozen=True)
class Load:
    """Load by wrk: requests in their order, repeatedly, over `connections` for whole `seconds`;
    each connection waits `think` ms on average before it asks again."""

    requests: tuple[bytes, ...]
    connections: int
    seconds: float = 2.0
    think: float = 0.0


@dataclass(frozen=True)
class Cost:
    """Result of a load: requests, seconds, the server's processor time, and latencies, s.

    size: bytes of an answer, its head among them.
    """

    requests: int
    seconds: float
    processor: float
    median: float
    p99: float
    size: float

    @property
    def each(self) -> float:
        """Processor time of a request, microseconds."""
        return 1e6 * self.processor / self.requests

    @property
    def rate(self) -> float:
        """Requests a second."""
        return self.requests / self.seconds


def get(target: str, *headers: str) -> bytes:
    """A GET as it travels."""
    lines = [f"GET {target} HTTP/1.1", "Host: 127.0.0.1", *headers]
    return "\r\n".join([*lines, "", ""]).encode()


def post(target: str, body: bytes) -> bytes:
    """A POST of JSON as it travels."""
    head = f"POST {target} HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/json\r\n"
    return head.encode() + b"Content-Length: %d\r\n\r\n" % len(body) + body


def run(server: Server, load: Load) -> Cost:
    """Send the load; exits where anything but an answer below 400 came back."""
    with TemporaryDirectory() as name:
        file = Path(name, "requests")
        file.write_bytes(b"".join(b"%d\n%b\n" % (len(one), one) for one in load.requests))
        before = server.processor()
        note = _wrk(server.url, file, load)
        spent = server.processor() - before
    answer = json.loads(note.splitlines()[-1])
    if answer["wrong"] or not answer["requests"]:
        sys.exit(f"{server.name}: {note}")
    count, waits = answer["requests"], (answer["median"], answer["p99"])
    return Cost(count, answer["seconds"], spent, *waits, answer["bytes"] / count)


def _wrk(url: str, file: Path, load: Load) -> str:
    if not (wrk := shutil.which("wrk")):
        sys.exit("wrk is missing; Debian: apt-get install wrk")
    count, seconds = f"-c{load.connections}", f"-d{load.seconds:g}s"
    arguments = [wrk, "-t1", count, seconds, "-s", SCRIPT, url, "--", file, f"{load.think:g}"]
    core = {max(os.sched_getaffinity(0))}
    done = subprocess.run(
        arguments,
        capture_output=True,
        text=True,
        preexec_fn=lambda: os.sched_setaffinity(0, core),
    )
    if done.returncode:
        sys.exit(f"wrk: {done.stdout}{done.stderr}")
    return done.stdout


def in_turn(runs: Sequence[tuple[Server, Load]], rounds: int) -> list[list[Cost]]:
    """Costs of each run in each round: all are run once, then all again, after a short warm-up."""
    for server, load in runs:
        run(server, Load(load.requests, load.connections, 1.0))
    return [*zip(*([run(*one) for one in runs] for _ in range(rounds)), strict=True)]
