"""Thin builder over onnx.helper: operators as calls that return the name of their value."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np
import numpy.typing as npt
import onnx
from onnx import TensorProto, helper, numpy_helper

# Versions of onnx 1.13, which every onnxruntime from 1.14 on loads.
OPSET, IR_VERSION = 18, 8

Shapes = dict[str, list[str | int]]
"""Axes by the name of an input or output: a fixed size, or the name of a free one."""

SLICE_END = 2**63 - 1
"""End of a slice that keeps everything; onnxruntime removes such slices when it loads."""
REGISTER = 16
"""Largest number of float32 values in a vector register."""


class GraphBuilder:
    """A graph under construction; equal calls in equal order give equal bytes."""

    def __init__(self) -> None:
        self._nodes: list[onnx.NodeProto] = []
        self._constants: dict[str, onnx.TensorProto] = {}

    def __call__(self, operator: str, *inputs: str, **attributes: Any) -> str:
        """Add a node and return the name of its first output."""
        return self.multi_output(operator, 1, *inputs, **attributes)[0]

    def multi_output(
        self, operator: str, outputs: int, *inputs: str, **attributes: Any
    ) -> list[str]:
        """Add a node and return the names of all its outputs."""
        stem = f"{operator.lower()}_{len(self._nodes)}"
        names = [stem] if outputs == 1 else [f"{stem}_{i}" for i in range(outputs)]
        self._nodes.append(helper.make_node(operator, inputs, names, **attributes))
        return names

    def rename_value(self, name: str, value: str) -> str:
        """Rename a value that no other node uses yet."""
        for node in self._nodes:
            node.output[:] = [name if output == value else output for output in node.output]
        return name

    def add_output(self, name: str, value: str) -> None:
        """Make a value an output of the graph under a name."""
        self._nodes.append(helper.make_node("Identity", [value], [name]))

    def weights(self, name: str, array: npt.NDArray[Any]) -> str:
        """Add a named constant, float32 unless it holds integers, and return its name.

        Raises ValueError for a second constant of the same name with other content.
        """
        kind = np.int64 if np.issubdtype(array.dtype, np.integer) else np.float32
        tensor = numpy_helper.from_array(np.asarray(array, dtype=kind, order="C"), name)
        if self._constants.setdefault(name, tensor) != tensor:
            raise ValueError(f"two different constants named {name!r}")
        return name

    def number(self, value: float) -> str:
        """Add a scalar constant, stored once, and return its name."""
        return self.weights(f"number_{value:.9g}", np.array(value))

    def indices(self, *values: int) -> str:
        """Add a list of integers, such as a shape, axes, starts or ends, and return its name."""
        return self.weights("indices_" + "_".join(map(str, values)), np.array(values))

    def row_sums(self, terms: str, pairs: str) -> str:
        """Sum terms (..., n) over the last axis to (..., 1), each row independent of its position.

        pairs: ones (n, 2). ReduceSum sums from aligned addresses, which differ between rows, and a
        product with one column processes rows in groups of four, so equal rows could round
        differently. With a second column each row is summed in the same order.
        """
        sums = self("MatMul", terms, pairs)
        return self("Slice", sums, self.indices(0), self.indices(1), self.indices(-1))

    def padded(self, row: str) -> str:
        """Append padding to a row (n,).

        The last numbers that do not fill a register are processed one by one and round differently
        in sine and cosine. The padding takes their place.
        """
        return self("Pad", row, self.indices(0, REGISTER - 1))

    def unpadded(self, row: str) -> str:
        """Remove the padding of a row."""
        return self("Slice", row, self.indices(0), self.indices(1 - REGISTER))

    def _kind(self, name: str) -> int:
        constant = self._constants.get(name)
        return constant.data_type if constant else TensorProto.FLOAT

    def model(
        self,
        inputs: Shapes,
        outputs: Shapes,
        metadata: dict[str, str],
        about: dict[str, str],
    ) -> bytes:
        """Return the finished file; inputs and outputs map a name to its shape.

        An input with the name of a constant is optional: the constant gives its default and type.
        All others are float32.
        """
        graph = helper.make_graph(
            self._nodes,
            "posefield",
            [helper.make_tensor_value_info(n, self._kind(n), s) for n, s in inputs.items()],
            [helper.make_tensor_value_info(n, TensorProto.FLOAT, s) for n, s in outputs.items()],
            list(self._constants.values()),
        )
        opsets = [helper.make_opsetid("", OPSET)]
        model = helper.make_model(graph, opset_imports=opsets, ir_version=IR_VERSION, **about)
        for key in sorted(metadata):
            model.metadata_props.add(key=key, value=metadata[key])
        onnx.checker.check_model(model, full_check=True)
        return bytes(model.SerializeToString(deterministic=True))


Integers = Sequence[int]


@dataclass(frozen=True)
class LevelTables:
    """Lists of integers by name, one list per level, the finest first.

    They are slice ends and shapes: every weight of a coarser level is a leading part of the finest
    one's, except for the thinned kriging weights.
    """

    entries: dict[str, list[Integers]]

    def onnx(self, net: GraphBuilder) -> dict[str, str]:
        """Build the chosen level's lists by name.

        `level` is an optional input of the graph; its default is zero, the finest level.
        """
        level = net.weights("level", np.array(0))
        rows = [list(chain(*lists)) for lists in zip(*self.entries.values(), strict=True)]
        table = net.weights("ladder", np.array(rows))
        sizes = [len(lists[0]) for lists in self.entries.values()]
        lists_of_level = net.multi_output(
            "Split", len(sizes), net("Gather", table, level), net.indices(*sizes)
        )
        return dict(zip(self.entries, lists_of_level, strict=True))
