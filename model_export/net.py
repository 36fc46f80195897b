"""A thin builder over onnx.helper: operators as calls that return the name of their value."""

from typing import Any

import numpy as np
import numpy.typing as npt
import onnx
from onnx import TensorProto, helper, numpy_helper

# The pair of onnx 1.13, which every onnxruntime from 1.14 on loads.
OPSET, IR_VERSION = 18, 8

Shapes = dict[str, list[str | int]]
"""Axes by the name of an input or output: a size, or a name for what the caller decides."""

REGISTER = 16
"""Numbers that a processor works on at once, at most."""


class Net:
    """A graph under construction; equal calls in equal order give equal bytes."""

    def __init__(self) -> None:
        self._nodes: list[onnx.NodeProto] = []
        self._constants: dict[str, onnx.TensorProto] = {}

    def __call__(self, operator: str, *inputs: str, **attributes: Any) -> str:
        """Name of the first output of a new node."""
        return self.many(operator, 1, *inputs, **attributes)[0]

    def many(self, operator: str, outputs: int, *inputs: str, **attributes: Any) -> list[str]:
        """Names of all outputs of a new node."""
        stem = f"{operator.lower()}_{len(self._nodes)}"
        names = [stem] if outputs == 1 else [f"{stem}_{i}" for i in range(outputs)]
        self._nodes.append(helper.make_node(operator, inputs, names, **attributes))
        return names

    def called(self, name: str, value: str) -> str:
        """A value that nobody has used yet under a name of its own, by which it is found later."""
        for node in self._nodes:
            node.output[:] = [name if own == value else own for own in node.output]
        return name

    def named(self, name: str, value: str) -> None:
        """Give a value the name under which the graph puts it out."""
        self._nodes.append(helper.make_node("Identity", [value], [name]))

    def weights(self, name: str, array: npt.NDArray[Any]) -> str:
        """A named constant, float32 unless it holds integers; a name stands for one content."""
        kind = np.int64 if np.issubdtype(array.dtype, np.integer) else np.float32
        tensor = numpy_helper.from_array(np.asarray(array, dtype=kind, order="C"), name)
        if self._constants.setdefault(name, tensor) != tensor:
            raise ValueError(f"two different constants named {name!r}")
        return name

    def number(self, value: float) -> str:
        """A scalar constant, stored once however often it is used."""
        return self.weights(f"number_{value:.9g}", np.array(value))

    def indices(self, *values: int) -> str:
        """A list of whole numbers: a shape, axes, starts or ends."""
        return self.weights("indices_" + "_".join(map(str, values)), np.array(values))

    def row_sums(self, terms: str, pairs: str) -> str:
        """Sums (..., 1) over the last axis of terms (..., n), the same for a row wherever it stands
        among others; pairs (n, 2): ones.

        ReduceSum adds from where memory is aligned, which differs from row to row, and a product
        with one column takes rows by fours. A second column leaves each row to itself.
        """
        sums = self("MatMul", terms, pairs)
        return self("Slice", sums, self.indices(0), self.indices(1), self.indices(-1))

    def padded(self, values: str) -> str:
        """All the numbers in a row, and some more.

        The last numbers of a row, which fill no register, get their sine and cosine one by one and
        rounded otherwise. Here those are nobody's.
        """
        row = self("Reshape", values, self.indices(-1))
        return self("Pad", row, self.indices(0, REGISTER - 1))

    def unpadded(self, row: str, shape: str) -> str:
        """The numbers of a padded row without the rest, in the shape that they had."""
        own = self("Slice", row, self.indices(0), self.indices(1 - REGISTER))
        return self("Reshape", own, shape)

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
        """The finished file; inputs and outputs map a name to its shape.

        An input with the name of a constant is optional: the constant is its default, and its type.
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
