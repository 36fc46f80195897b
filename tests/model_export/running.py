"""Evaluation of graph fragments in onnxruntime."""

from collections.abc import Callable

import numpy as np
import onnxruntime

from posefield.common.units import Floats
from posefield_train.kriging import kriging_graph
from posefield_train.kriging.kriging_bank import KrigingBank
from posefield_train.onnx_graph import GraphBuilder, LevelTables


def bank_values(
    net: GraphBuilder, bank: KrigingBank, controls: str, ranks: list[int]
) -> tuple[str, ...]:
    """Build the values of a bank at levels of these ranks, and sigma (B,) last."""
    ends = LevelTables(kriging_graph.entries(bank, ranks)).onnx(net)
    fields = kriging_graph.onnx(bank, net, controls, ends)
    fields["sigma"] = net("Gather", fields["sigma"], net.weights("first", np.array(0)), axis=1)
    return tuple(fields.values())


def outputs(
    build: Callable[..., str | tuple[str, ...]],
    axes: tuple[int, ...],
    level: int | None = None,
    **inputs: Floats,
) -> list[Floats]:
    """Return the float32 outputs of `build(net, *input names)`; axes: number of axes of each.

    level: of detail, for a graph with a ladder; the graph's default if None.
    """
    net = GraphBuilder()
    built = build(net, *inputs)
    names = [built] if isinstance(built, str) else list(built)
    shapes = {name: [f"{name}_{i}" for i in range(a.ndim)] for name, a in inputs.items()}
    shapes |= {} if level is None else {"level": []}
    results = {f"result_{i}": [f"axis_{i}_{j}" for j in range(n)] for i, n in enumerate(axes)}
    for result, name in zip(results, names, strict=True):
        net.add_output(result, name)
    content = net.model(shapes, results, {}, {"producer_name": "test"})
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = 4
    session = onnxruntime.InferenceSession(content, options, providers=["CPUExecutionProvider"])
    feed = {name: array.astype(np.float32) for name, array in inputs.items()}
    feed |= {} if level is None else {"level": np.array(level)}
    return session.run(list(results), feed)
