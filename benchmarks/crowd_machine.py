"""Peak speed of one core of this machine, as far as plain code can measure it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import onnxruntime
from rows import Row
from timing import in_turn

from posefield_train.onnx_graph import GraphBuilder

# A product whose three matrices lie in a core's own cache; copies within and far beyond it.
SIZE, NEAR, FAR = 256, 1 << 18, 1 << 26


@dataclass(frozen=True)
class Machine:
    """Multiply-adds a second in float32, by onnxruntime and by NumPy's BLAS; bytes a second, read
    and written, of copies within the cache and beyond."""

    work: float
    blas: float
    near: float
    far: float

    def rows(self) -> list[Row]:
        """The bounds, a row each."""
        return [
            _row("float32 products by onnxruntime", 2e-9 * self.work, "GFLOP/s"),
            _row("the same by NumPy's BLAS", 2e-9 * self.blas, "GFLOP/s"),
            _row("copies within its cache, read and written", 1e-9 * self.near, "GB/s"),
            _row("copies in memory, read and written", 1e-9 * self.far, "GB/s"),
        ]


def _row(name: str, value: float, unit: str) -> Row:
    return Row(f"one core here: {name}", value, unit, "", None, None)


def measure() -> Machine:
    """This machine, by one thread."""
    left, right = np.random.default_rng(0).random((2, SIZE, SIZE), np.float32)
    out = np.empty_like(left)
    session = _product(right)
    runs: dict[str, Callable[[], object]] = {
        "work": lambda: session.run(None, {"left": left}),
        "blas": lambda: np.matmul(left, right, out=out),
        "near": _copy(NEAR),
        "far": _copy(FAR),
    }
    timings = in_turn(runs, rounds=31, repeats=5)
    work, blas = (SIZE**3 / timings[name] for name in ("work", "blas"))
    return Machine(work, blas, 2.0 * NEAR / timings["near"], 2.0 * FAR / timings["far"])


def _product(right: Any) -> Any:
    net = GraphBuilder()
    net.add_output("product", net("MatMul", "left", net.weights("right", right)))
    shape: list[str | int] = [SIZE, SIZE]
    content = net.model({"left": shape}, {"product": shape}, {}, {})
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    return onnxruntime.InferenceSession(content, options, providers=["CPUExecutionProvider"])


def _copy(size: int) -> Callable[[], object]:
    source = np.ones(size // 4, np.float32)
    target = np.empty_like(source)
    return lambda: np.copyto(target, source)
