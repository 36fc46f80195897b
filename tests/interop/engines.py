"""Comparison of the same model file in other inference engines with onnxruntime's results.

OpenVINO, tract and onnxruntime-web (on Node) run in their own processes.
"""

import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path

import environment
import numpy as np
import trained

from posefield.inference.onnx_runtime import OUTPUTS
from posefield.inference.session import Session

HERE = Path(__file__).parent
VENV = environment.ROOT / ".venv-engines"
PACKAGES = ("openvino==2026.4.1", "tract==0.23.9")
WEB = environment.ROOT / "build/web"
WEB_PACKAGES = ("onnxruntime-web@1.23.0",)
# Engines sum in another order: metres, seconds and parts of a quaternion. The next level of detail
# is off by much more, which is looked at too.
CLOSE = 2e-5
# OpenVINO takes the double precision of the file, in which large terms of sigma cancel, as single.
LIMITS = {("openvino", "sigma"): 1e-4}

Tensors = Mapping[str, np.ndarray]


def faults(node: Path, npm: Path) -> list[str]:
    """Return the faults of OpenVINO and onnxruntime-web, a line each."""
    python = environment.packages(VENV, PACKAGES)
    web = environment.modules(WEB, WEB_PACKAGES, node, npm)
    model, content = trained.family()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "reaching.onnx").write_bytes(content)
        question = _question(model.session)
        np.savez(folder / "question.npz", **question)
        asked = question["controls"], question["time"]
        expected = dict(zip(OUTPUTS, model.session.run(*asked, *OUTPUTS), strict=True))
        other = dict(zip(OUTPUTS, model.session.run(*asked, *OUTPUTS, level=1), strict=True))
        found = {name: _python(python, folder, name) for name in ("openvino", "tract")}
        found["onnxruntime-web"] = _web(node, web, folder, question)
        return [*_compared(found, expected, other)]


def _compared(found: Mapping[str, Tensors], right: Tensors, wrong: Tensors) -> Iterator[str]:
    print(f"{'engine':<20}{'off':>10}{'another level':>16}")
    for engine, answers in found.items():
        distances = _distances(answers, right)
        control = max(_distances(answers, wrong).values())
        print(f"{engine:<20}{max(distances.values()):>10.1e}{control:>16.1e}")
        limits = {name: LIMITS.get((engine, name), CLOSE) for name in distances}
        close = all(distances[name] < limit for name, limit in limits.items())
        if not close or control < max(limits.values()):
            yield f"{engine}: off by {distances}, and by {control:g} from another level"


def _distances(answers: Tensors, expected: Tensors) -> dict[str, float]:
    """The largest difference of each tensor; infinite where tensors or shapes differ."""
    if {n: a.shape for n, a in answers.items()} != {n: e.shape for n, e in expected.items()}:
        return {"shapes": float("inf")}
    return {name: _apart(answers[name], expected[name], name) for name in expected}


def _apart(one: np.ndarray, other: np.ndarray, name: str) -> float:
    # A quaternion and its negative are one rotation.
    signs = np.sign((one * other).sum(-1, keepdims=True)) if name == "rotations" else 1.0
    return float(abs(one - signs * other).max())


def _question(session: Session) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(7)
    low, high = np.array([[c.minimum, c.maximum] for c in session.card.controls]).T
    points = (low + rng.random((40, len(low))) * (high - low)).astype(np.float32)
    times = rng.random((40, 3)) * session.run(points, None, "duration")[0][:, None]
    return {"controls": points, "time": times.astype(np.float32)}


def _python(python: Path, folder: Path, engine: str) -> Tensors:
    result = folder / f"{engine}.npz"
    model, question = folder / "reaching.onnx", folder / "question.npz"
    _call(python, HERE / f"{engine}_read.py", model, question, result)
    return _loaded(result)


def _web(node: Path, modules: Path, folder: Path, question: Tensors) -> Tensors:
    asked, result = folder / "question.json", folder / "web.json"
    plain = {n: {"shape": t.shape, "data": t.ravel().tolist()} for n, t in question.items()}
    asked.write_text(json.dumps(plain))
    _call(node, HERE / "web_read.mjs", modules, folder / "reaching.onnx", asked, result)
    found = json.loads(result.read_text())
    return {n: np.array(t["data"], np.float32).reshape(t["shape"]) for n, t in found.items()}


def _loaded(path: Path) -> Tensors:
    with np.load(path) as found:
        return dict(found)


def _call(*command: str | Path) -> None:
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{command[1]} failed:\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}")


if __name__ == "__main__":
    found = faults(*environment.node())
    print("\n".join(found) or "no fault in any engine")
    sys.exit(bool(found))
