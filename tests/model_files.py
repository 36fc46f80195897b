"""Model files derived from a trained one: other versions, damaged and hostile files."""

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from posefield.model_file import checked_file, onnx_file

METADATA = 14
"""Number of the field of an ONNX file that holds an entry of its metadata."""


def numbered(content: bytes, number: int) -> bytes:
    """Return the same model in other bytes: a number is written into its metadata."""
    entry = onnx_file.encode_bytes(1, b"number") + onnx_file.encode_bytes(2, b"%04d" % number)
    return checked_file.append_checksum(
        content[: -checked_file.CHECKSUM_SIZE] + onnx_file.encode_bytes(METADATA, entry)
    )


def written(model: onnx.ModelProto) -> bytes:
    """Return a changed model as posefield would have written it, with the checksum of its bytes."""
    others = [
        entry for entry in model.metadata_props if entry.key != checked_file.CHECKSUM_KEY.decode()
    ]
    del model.metadata_props[:]
    model.metadata_props.extend(others)
    return checked_file.append_checksum(model.SerializeToString(deterministic=True))


def slow(content: bytes) -> bytes:
    """Return a model that takes minutes to open: a thousand products of large matrices."""
    size = 3000
    return _with_sigma(content, [size, size], products=1000)


def large(content: bytes, numbers: int = 1_500_000_000) -> bytes:
    """Return a model that takes 6 GB to open, or so many numbers of float32."""
    return _with_sigma(content, [numbers], products=0)


def _with_sigma(content: bytes, shape: list[int], products: int) -> bytes:
    """Make sigma depend on an array of ones multiplied with itself, by posefield's operators."""
    model = onnx.load_from_string(content)
    graph = model.graph
    for name, values in (("one", np.ones(1, np.float32)), ("size", np.array(shape))):
        graph.initializer.append(numpy_helper.from_array(values, f"hostile_{name}"))
    for node in graph.node:
        node.output[:] = ["plain_sigma" if name == "sigma" else name for name in node.output]
    graph.node.append(helper.make_node("Expand", ["hostile_one", "hostile_size"], ["power_0"]))
    for number in range(products):
        powers = [f"power_{number}", "power_0"]
        graph.node.append(helper.make_node("MatMul", powers, [f"power_{number + 1}"]))
    graph.node.append(helper.make_node("ReduceSum", [f"power_{products}"], ["sum"], keepdims=0))
    graph.node.append(helper.make_node("Min", ["plain_sigma", "sum"], ["sigma"]))
    return written(model)


def loop(content: bytes) -> bytes:
    """Return a model with a loop of 10¹² rounds."""
    model = onnx.load_from_string(content)
    flag, counter = (
        helper.make_tensor_value_info(name, kind, [])
        for name, kind in (("on", TensorProto.BOOL), ("i", TensorProto.INT64))
    )
    going = helper.make_tensor_value_info("going", TensorProto.BOOL, [])
    step = helper.make_node("Identity", ["on"], ["going"])
    body = helper.make_graph([step], "body", [counter, flag], [going])
    model.graph.initializer.append(numpy_helper.from_array(np.array(10**12), "rounds"))
    model.graph.node.append(helper.make_node("Loop", ["rounds", ""], [], body=body))
    return written(model)
