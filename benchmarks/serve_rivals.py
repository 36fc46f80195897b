"""The same model behind MLServer, LitServe and BentoML: poses a second on one core.

    make build/models/reaching.onnx && .venv/bin/python benchmarks/serve_rivals.py [MODEL]

Each has an environment of its own in build/rivals, made once, and the leanest adapter that its own
documentation leads to (benchmarks/rivals): one thread in the graph, one worker, no access log,
uvloop and httptools. Ours has its usual settings, its log and metrics among them. Each server has
all its processes on the first core, and wrk the last.
"""

import json
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import httpx
import numpy as np
import orjson
from rows import Row, table
from serve import MODEL, TOGETHER, Numbers, pose_questions
from serve_load import Cost, Load, get, in_turn, post
from serve_process import PATIENCE, Server, free_port, posefield, started

from posefield.inference import session

HERE = Path(__file__).parent
ADAPTERS = HERE / "rivals"
VENVS = HERE.parent / "build/rivals"
UV = Path(sys.executable).with_name("uv")
ROUNDS = 3
CLOSE = 1e-5

Body = Callable[[list[float], float], Any]
Read = Callable[[Any], Any]


@dataclass(frozen=True)
class Place:
    """Place of a rival: its programs, a folder of its own, the model and a port."""

    programs: Path
    folder: Path
    model: Path
    port: int


@dataclass(frozen=True)
class Rival:
    """A server; goal: how many times its rate ours is. body: what it is asked with, and rotations:
    where those are in its answer, flat or not."""

    name: str
    goal: float
    path: str
    body: Body
    rotations: Read
    command: Callable[[Place], list[str | Path]]


def rows(model: Path, rounds: int = ROUNDS) -> list[Row]:
    """Ours against each of them, in turn with it alone."""
    with posefield(model) as ours:
        return [_row(ours, rival, model, rounds) for rival in RIVALS]


def _row(ours: Server, rival: Rival, model: Path, rounds: int) -> Row:
    names = [control.name for control in session.load(model).card.controls]
    questions = pose_questions(session.load(model).card.controls)
    path = f"/v1/models/{model.stem}/pose"
    requests = tuple(get(f"{path}?{urlencode(question)}") for question in questions)
    bodies = [rival.body([q[name] for name in names], q["time"]) for q in questions]
    requests = tuple(post(rival.path, orjson.dumps(body)) for body in bodies)
    with _serving(rival, model) as other:
        for question, body in list(zip(questions, bodies, strict=True))[:10]:
            _check(ours.url + path, question, other.url + rival.path, body, rival.rotations)
        runs = [(ours, Load(requests, TOGETHER)), (other, Load(requests, TOGETHER))]
        return _compared(rival, *in_turn(runs, rounds))


def _compared(rival: Rival, ours: Sequence[Cost], rest: Sequence[Cost]) -> Row:
    ratios = [a.rate / b.rate for a, b in zip(ours, rest, strict=True)]
    rate, other = (max(cost.rate for cost in costs) for costs in (ours, rest))
    cost, spent = (min(cost.each for cost in costs) for costs in (ours, rest))
    note = (
        f"{rival.name}: {other:.0f} a second, {spent:.0f} µs of processor time each, ours "
        f"{cost:.0f} µs; rounds {min(ratios):.1f} to {max(ratios):.1f}"
    )
    name = f"poses a second, {TOGETHER} connections"
    return Row(name, rate, "/s", note, statistics.median(ratios), rival.goal)


def _check(url: str, question: Numbers, other: str, body: Any, rotations: Read) -> None:
    answers = httpx.get(url, params=question).raise_for_status().json()["rotations"]
    answer = _first(other, body)
    np.testing.assert_allclose(np.ravel(rotations(answer)), np.ravel(answers), atol=CLOSE)


@contextmanager
def _serving(rival: Rival, model: Path) -> Iterator[Server]:
    key, port = rival.name.lower(), free_port()
    folder = VENVS / f"{key}-run"
    folder.mkdir(parents=True, exist_ok=True)
    path = model.resolve()
    command = rival.command(Place(_environment(key), folder, path, port))
    # None of them is to tell its makers of this.
    environment = {"PYTHONPATH": str(ADAPTERS), "MODEL": str(path), "BENTOML_DO_NOT_TRACK": "True"}
    with started(key, command, port, environ=environment, folder=folder) as server:
        yield server


def _first(url: str, body: Any) -> Any:
    """An answer; some listen long before they answer."""
    end = time.monotonic() + PATIENCE
    while True:
        try:
            return httpx.post(url, json=body, timeout=30).raise_for_status().json()
        except httpx.HTTPError:
            if time.monotonic() > end:
                raise
            time.sleep(0.2)


def _environment(key: str) -> Path:
    """Folder of programs of the environment, made where it is not the one wanted."""
    requirements, venv = ADAPTERS / f"{key}.txt", VENVS / key
    stamp = venv / ".installed"
    if not stamp.exists() or stamp.read_text() != requirements.read_text():
        subprocess.run([UV, "venv", "-q", "--clear", "-p", sys.executable, venv], check=True)
        python = venv / "bin/python"
        subprocess.run([UV, "pip", "install", "-q", "-p", python, "-r", requirements], check=True)
        stamp.write_text(requirements.read_text())
    return venv / "bin"


def _mlserver(location: Place) -> list[str | Path]:
    ports = {"http_port": location.port, "grpc_port": free_port(), "metrics_port": free_port()}
    settings = {"host": "127.0.0.1", "parallel_workers": 0, "debug": False, "gzip_enabled": False}
    parameters = {"uri": str(location.model)}
    model = {"name": "pose", "implementation": "mlserver_pose.Pose", "parameters": parameters}
    (location.folder / "settings.json").write_text(json.dumps({**settings, **ports}))
    (location.folder / "model-settings.json").write_text(json.dumps(model))
    return [location.programs / "mlserver", "start", location.folder]


def _litserve(location: Place) -> list[str | Path]:
    script = ADAPTERS / "litserve_pose.py"
    return [location.programs / "python", script, location.model, str(location.port)]


def _bentoml(location: Place) -> list[str | Path]:
    arguments = ["--host", "127.0.0.1", "--port", str(location.port), "--working-dir", ADAPTERS]
    return [location.programs / "bentoml", "serve", "bentoml_pose:Pose", *arguments]


def _tensors(controls: list[float], when: float) -> dict[str, Any]:
    """A question of the Open Inference Protocol."""
    body = {"controls": controls, "time": [when]}
    return {
        "inputs": [
            {"name": name, "shape": [1, len(row)], "datatype": "FP32", "data": row}
            for name, row in body.items()
        ]
    }


def _rows(controls: list[float], when: float) -> dict[str, Any]:
    return {"controls": controls, "time": [when]}


RIVALS = (
    Rival(
        "MLServer",
        5.0,
        "/v2/models/pose/infer",
        _tensors,
        lambda answer: answer["outputs"][0]["data"],
        _mlserver,
    ),
    Rival("LitServe", 8.0, "/predict", _rows, lambda answer: answer["rotations"], _litserve),
    Rival("BentoML", 10.0, "/pose", _rows, lambda answer: answer["rotations"], _bentoml),
)


if __name__ == "__main__":
    print(table(rows(Path(sys.argv[1]) if sys.argv[1:] else MODEL)))
