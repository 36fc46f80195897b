"""Cost of models to the process that serves them: start, memory, and waiting while one changes.

.venv/bin/python benchmarks/serve_models.py [MODEL]

MODEL defaults to build/models/reaching.onnx. Ten models are that one in ten contents. Requests wait
behind a reload as long as the slowest of those says that run during it; beside it stand those of
the same server when nothing is loaded.
"""

import os
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import httpx
from rows import Row, table

from posefield.model_file import checked_file, onnx_file

POSEFIELD = Path(sys.executable).with_name("posefield")
MODEL = Path("build/models/reaching.onnx")
STARTS, RELOADS = 5, 20
READY, MEMORY = 2.0, 250.0
QUIET = {"POSEFIELD_PORT": "0", "POSEFIELD_LOG": "off"}
LIBRARIES = "import numpy, onnxruntime, uvicorn; from pxr import UsdSkel"


def rows(model: Path) -> list[Row]:
    """Start to ready and resident memory with one and ten models, and requests beside reloads."""
    with TemporaryDirectory() as name:
        one, ten = Path(name, "one"), Path(name, "ten")
        _models(model, one, 1)
        _models(model, ten, 10)
        return [*_start(one), *_start(ten), *_workers(ten), *_memory(one, ten), *_reloads(ten)]


def content(model: Path, number: int) -> bytes:
    """The model in other bytes, which answer the same: a number in its metadata."""
    return numbered(model.read_bytes(), number)


def numbered(sealed: bytes, number: int) -> bytes:
    """A model file with a number in its metadata, and the checksum of that."""
    entry = onnx_file.encode_bytes(1, b"number") + onnx_file.encode_bytes(2, b"%04d" % number)
    return checked_file.append_checksum(
        sealed[: -checked_file.CHECKSUM_SIZE] + onnx_file.encode_bytes(14, entry)
    )


def _models(model: Path, folder: Path, count: int) -> None:
    folder.mkdir()
    for number in range(count):
        (folder / f"model{number}.onnx").write_bytes(content(model, number))


@contextmanager
def _serving(
    folder: Path, **environ: str
) -> Iterator[tuple[subprocess.Popen[bytes], httpx.Client, float]]:
    """The server, a client of it, and seconds until it said that it listens."""
    environment = {**os.environ, **QUIET, **environ}
    begin, command = time.perf_counter(), [POSEFIELD, "serve", str(folder)]
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE) as process:
        assert process.stdout
        base = process.stdout.readline().decode().split()[-1]
        took = time.perf_counter() - begin
        try:
            with httpx.Client(base_url=base, timeout=60) as client:
                yield process, client, took
        finally:
            process.terminate()
            process.wait()


def _taken(folder: Path, **environ: str) -> list[float]:
    seconds = []
    for _ in range(STARTS):
        with _serving(folder, **environ) as (_, _, took):
            seconds.append(took)
    return sorted(seconds)


def _start(folder: Path) -> list[Row]:
    took, count = _taken(folder), len(list(folder.iterdir()))
    with _serving(folder) as (process, _, _):
        processor_time = _processor_time(process.pid)
    note = (
        f"of {STARTS}; {took[0]:.2f} to {took[-1]:.2f} s; {processor_time:.2f} s of CPU time, "
        f"where its libraries take {_imported():.2f}"
    )
    return [Row(f"start to ready, {count} models", statistics.median(took), "s", note, None, READY)]


def _imported() -> float:
    """Seconds of processor time that Python takes to load the libraries and nothing of ours."""
    before = os.times()
    subprocess.run([sys.executable, "-c", LIBRARIES], check=True, env={**os.environ, **QUIET})
    after = os.times()
    return sum(after[2:4]) - sum(before[2:4])


def _workers(folder: Path) -> list[Row]:
    took = _taken(folder, POSEFIELD_WORKERS="2")
    note = f"of {STARTS}; {took[0]:.2f} to {took[-1]:.2f} s, on {os.cpu_count()} cores"
    return [
        Row("start to ready, 10 models, 2 workers", statistics.median(took), "s", note, None, None)
    ]


def _memory(one: Path, ten: Path) -> list[Row]:
    table_rows = []
    for folder, goal in ((one, None), (ten, MEMORY)):
        with _serving(folder) as (process, client, _):
            initial = resident(process.pid)
            names = [model["name"] for model in client.get("/v1/models").json()["models"]]
            for name in names:
                _use(client, name)
            used = resident(process.pid)
        note = f"{initial:.0f} MB before a pose and a clip of each level of each was asked"
        table_rows.append(
            Row(f"resident memory, {len(names)} models", used, "MB", note, None, goal)
        )
    return table_rows


def _use(client: httpx.Client, name: str) -> None:
    card = client.get(f"/v1/models/{name}").json()
    controls = {control["name"]: control["default"] for control in card["controls"]}
    for level in range(len(card["levels"])):
        query = {**controls, "level": level}
        client.get(f"/v1/models/{name}/pose", params={**query, "time": 0}).raise_for_status()
        client.get(f"/v1/models/{name}/clip.usdc", params=query).raise_for_status()


def _reloads(folder: Path) -> list[Row]:
    """Slowest requests with and without reloads, and what memory grows by."""
    with _serving(folder, POSEFIELD_RELOAD="1") as (process, client, _):
        _use(client, "model0")
        controls = client.get("/v1/models/model0").json()["controls"]
        query = {**{c["name"]: c["default"] for c in controls}, "time": 0}
        quiet, busy, sizes = [], [], []
        for number in range(RELOADS):
            quiet += _asked(client, query, 0.3)
            _replace(folder, number)
            before = client.get("/readyz").json()["reload"]["opened"]
            while client.get("/readyz").json()["reload"]["opened"] == before:
                busy += _asked(client, query, 0.05)
            sizes.append(resident(process.pid))
    rows = []
    for what, share in (("median", 0.5), ("p99", 0.99), ("slowest", 1.0)):
        busy_time, other = (1e3 * _at(times, share) for times in (busy, quiet))
        note = f"without: {other:.1f} ms"
        rows.append(
            Row(f"request while models are reloaded, {what}", busy_time, "ms", note, None, None)
        )
    half = RELOADS // 2
    note = f"of {half} more; {sizes[half - 1]:.0f} MB after {half}"
    grown = sizes[-1] - sizes[half - 1]
    return [*rows, Row("memory that reloads add", grown, "MB", note, None, None)]


def _asked(client: httpx.Client, question: dict[str, float], seconds: float) -> list[float]:
    """Seconds that requests took, asked one after the other for so long."""
    took, end = [], time.perf_counter() + seconds
    while (begin := time.perf_counter()) < end:
        client.get("/v1/models/model1/pose", params=question).raise_for_status()
        took.append(time.perf_counter() - begin)
    return took


def _replace(folder: Path, number: int) -> None:
    path = folder / "model0.onnx"
    aside = folder / "aside"
    aside.write_bytes(numbered(path.read_bytes(), 1000 + number))
    aside.rename(path)


def _processor_time(process: int) -> float:
    """Seconds that a process has computed."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return sum(int(ticks) for ticks in fields[11:13]) / os.sysconf("SC_CLK_TCK")


def _at(times: list[float], share: float) -> float:
    return sorted(times)[min(len(times) - 1, int(share * len(times)))]


def resident(process: int) -> float:
    """Resident memory of a process, MB."""
    lines = Path(f"/proc/{process}/status").read_text().splitlines()
    kilobytes = next(line.split()[1] for line in lines if line.startswith("VmRSS"))
    return int(kilobytes) * 1024 / 1e6


if __name__ == "__main__":
    print(table(rows(Path(sys.argv[1]) if sys.argv[1:] else MODEL)))
