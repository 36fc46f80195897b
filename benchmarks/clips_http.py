"""Archives of many clips over HTTP, against the same bytes made in this process without it.

OPENBLAS_NUM_THREADS=1 .venv/bin/python benchmarks/clips_http.py
"""

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import crowd_models
import family
import httpx
import numpy as np
import orjson
from family import Family
from rows import Row, table
from timing import in_turn

from posefield.batch.job import archive_members
from posefield.encode import archives
from posefield.http import archive_operations
from posefield.http.api.settings import Settings
from posefield.synthesis.synthesizer import Synthesizer

CLIPS, FEW, MANY = 500, 100, 5000
FORMATS = ("usdc", "json")
PATH = "/v1/models/reaching/clips.zip"
LIMITS = {"POSEFIELD_CLIPS_POSES": "10000000", "POSEFIELD_PORT": "0"}
POSEFIELD = Path(sys.executable).with_name("posefield")


def rows(trained_family: Family) -> list[Row]:
    """Clips a second, seconds to the first byte, and most memory of the server's process."""
    model = crowd_models.reaching(trained_family)
    with TemporaryDirectory() as name:
        path = Path(name, "reaching.onnx")
        path.write_bytes(trained_family.exported.content)
        return [row for extension in FORMATS for row in _rows(model, path, extension)]


def _rows(model: Synthesizer, path: Path, extension: str) -> list[Row]:
    body, few, many = (_body(model, extension, count) for count in (CLIPS, FEW, MANY))
    with _serving(path) as (process, client):
        _taken(client, few)
        low = _most_memory(process)
        size = _taken(client, many)
        high = _most_memory(process)
        runs = {
            "http": lambda: _taken(client, body),
            "here": lambda: _made(model, body),
            "first": lambda: _first(client, many),
        }
        took = in_turn(runs, rounds=5, repeats=1)
    note = f"{CLIPS} clips as {extension}, {size / MANY / 1e3:.0f} kB each, zip"
    here = f"in this process, to nowhere: {CLIPS / took['here']:.0f}"
    more = f"after {FEW} clips: {low / 1e6:.0f} MB; the archive has {size / 1e6:.0f} MB"
    return [
        Row(
            note, CLIPS / took["http"], "clips/s over HTTP", here, took["here"] / took["http"], None
        ),
        Row(f"first byte of {MANY} clips", took["first"], "s", "all are checked", None, None),
        Row(f"most memory of the server, {MANY} clips", high / 1e6, "MB", more, None, None),
    ]


def _body(model: Synthesizer, extension: str, count: int) -> bytes:
    rng = np.random.default_rng(1)
    ranges = {c.name: (c.minimum, c.maximum) for c in model.session.card.controls}
    clips = [
        {"controls": {name: rng.uniform(*limits) for name, limits in ranges.items()}, "fps": 60}
        for _ in range(count)
    ]
    return orjson.dumps({"format": extension, "clips": clips})


@contextmanager
def _serving(path: Path) -> Iterator[tuple[subprocess.Popen[bytes], httpx.Client]]:
    command, environ = [POSEFIELD, "serve", str(path)], {**os.environ, **LIMITS}
    with subprocess.Popen(command, env=environ, stdout=subprocess.PIPE) as process:
        assert process.stdout
        base = process.stdout.readline().decode().split()[-1]
        try:
            with httpx.Client(base_url=base, timeout=600) as client:
                yield process, client
        finally:
            process.terminate()


def _asked(client: httpx.Client, body: bytes) -> Any:
    return client.stream("POST", PATH, content=body, headers={"content-type": "application/json"})


def _taken(client: httpx.Client, body: bytes) -> int:
    """Bytes of an archive that is taken and forgotten."""
    with _asked(client, body) as answer:
        return sum(map(len, answer.iter_raw()))


def _first(client: httpx.Client, body: bytes) -> None:
    with _asked(client, body) as answer:
        next(answer.iter_raw())


def _made(model: Synthesizer, body: bytes) -> int:
    """Bytes of the same archive without a server."""
    order = archive_operations.clip_order(model, body, Settings())
    return sum(map(len, archives.zip(archive_members(order.files()))))


def _most_memory(process: subprocess.Popen[bytes]) -> int:
    time.sleep(0.1)
    status = Path(f"/proc/{process.pid}/status").read_text()
    return 1024 * int(status.partition("VmHWM:")[2].split()[0])


if __name__ == "__main__":
    with TemporaryDirectory() as folder:
        print(table(rows(family.make(Path(folder, "family")))))
