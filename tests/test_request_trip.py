"""Tests of how far a warm request travels: modules and functions entered, and classes made.

The figures are ceilings: who lowers one writes the lower figure here.
"""

import asyncio
import json
import re
import subprocess
import sys
import threading
from dataclasses import dataclass, field
from pathlib import Path

import pytest

import posefield
from posefield.http import app
from posefield.http.api.settings import Settings
from posefield.registry import model_registry

ROOT = f"{Path(posefield.__file__).parent}/"
ARCHITECTURE = Path(__file__).parents[1] / "docs/architecture"
REACH = b"stature=1.72&hip_height=0.9&turn=20&target_height=1.1"
WALK = {"kind": "walk", "model": "cmu_walk", "to": [0.0, 3.0], "speed": 1.2}
SCRIPT = {"fps": 30, "segments": [WALK, {"kind": "hold", "seconds": 0.5}]}
REQUESTS = {
    "plain clip": ("GET", "/v1/models/reaching/clip.usdc", REACH, b""),
    "standing feet": ("GET", "/v1/models/cmu_walk/clip.usdc", b"speed=1.3&turn=0", b""),
    "pose": ("GET", "/v1/models/reaching/pose.json", REACH + b"&time=0.5", b""),
    "crowd": ("GET", "/v1/models/cmu_walk/crowd.usdc", b"count=3&seconds=1&seed=7", b""),
    "performance": ("POST", "/v1/performances.usdc", b"", json.dumps(SCRIPT).encode()),
}
CEILINGS = {
    "plain clip": (27, 156, 11),
    "standing feet": (45, 320, 18),
    "pose": (19, 58, 5),
    "crowd": (42, 355, 26),
    "performance": (54, 419, 37),
}
"""Most modules, functions and classes of each request."""
TIMED = {"DeadlineTimer._check", "set_open_requests"}
"""Functions of the timer of deadlines, ten times a second, which are of no request."""


@dataclass
class Trip:
    """Modules and functions that a request enters, and the classes of the objects it makes."""

    modules: set[str] = field(default_factory=set)
    functions: set[tuple[str, int]] = field(default_factory=set)
    classes: set[str] = field(default_factory=set)

    def __call__(self, frame, event, _):
        if event != "call":
            return
        code, instance = frame.f_code, frame.f_locals.get("self")
        if code.co_name == "__init__" and type(instance).__module__.startswith("posefield"):
            self.classes.add(type(instance).__name__)
        if code.co_filename.startswith(ROOT) and code.co_qualname not in TIMED:
            self.modules.add(code.co_filename)
            # Comprehensions are calls in Python 3.11 only.
            if not code.co_name.startswith("<"):
                self.functions.add((code.co_filename, code.co_firstlineno))

    @property
    def counts(self):
        return len(self.modules), len(self.functions), len(self.classes)

    @property
    def files(self):
        return sorted(module.removeprefix(ROOT) for module in self.modules)


async def ask(application, method, path, query, body):
    """Return the status of a request to an application of this process."""
    headers = [(b"host", b"127.0.0.1"), (b"content-type", b"application/json")]
    ends = {"client": ("127.0.0.1", 1), "server": ("127.0.0.1", 80), "headers": headers}
    words = {"http_version": "1.1", "scheme": "http", "root_path": "", "raw_path": path.encode()}
    scope = {"type": "http", "method": method, "path": path, "query_string": query, **words, **ends}
    messages, sent = [{"type": "http.request", "body": body, "more_body": False}], []

    async def receive():
        return messages.pop() if messages else await asyncio.Event().wait()

    async def send(message):
        sent.append(message)

    await application(scope, receive, send)
    return sent[0]["status"]


async def trips():
    """Yield the name, status and trip of each request, asked the fourth time."""
    application = app.create_app(
        model_registry.load([Path(ROOT, "shipped/cmu_walk.onnx"), sys.argv[1]]), Settings()
    )
    trip = None

    def hook(frame, event, value):
        if trip is not None:
            trip(frame, event, value)

    # Before the application starts its threads, which keep the hook of their start.
    threading.setprofile(hook)
    for name, request in REQUESTS.items():
        for _ in range(3):
            await ask(application, *request)
        trip = Trip()
        sys.setprofile(hook)
        status = await ask(application, *request)
        sys.setprofile(None)
        yield name, status, trip
        trip = None


async def main():
    async for name, status, trip in trips():
        sys.stdout.write(f"{json.dumps([name, status, trip.files, *trip.counts])}\n")


@pytest.mark.parametrize("name", REQUESTS)
def test_a_request_travels_no_further_than_its_ceiling(name, counts):
    status, _, *figures = counts[name]
    assert status == 200
    assert all(figure <= most for figure, most in zip(figures, CEILINGS[name], strict=True)), (
        f"{name}: {figures} modules, functions and classes, at most {CEILINGS[name]}"
    )
    # A ceiling that is far away would keep nothing.
    assert figures[0] > 0.9 * CEILINGS[name][0] and figures[1] > 0.9 * CEILINGS[name][1]


def test_a_plain_clip_is_read_in_the_files_that_the_architecture_names(counts):
    page = (ARCHITECTURE / "05-service-and-clients.md").read_text()
    files = re.findall(r"^[1-8]\. `(\w+/\w+\.py)`", page, re.MULTILINE)
    assert len(files) == 8
    assert set(files) <= set(counts["plain clip"][1])


@pytest.fixture(scope="module")
def counts(model_path):
    """Status and counts of each request, in a process without other tests' hooks and caches."""
    words = [sys.executable, __file__, model_path]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    return {name: figures for name, *figures in map(json.loads, done.stdout.splitlines())}


if __name__ == "__main__":
    asyncio.run(main())
