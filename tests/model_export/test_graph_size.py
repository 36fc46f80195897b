"""Tests of the number of nodes that onnxruntime runs for each question: each takes 0.5 µs."""

import onnx
import pytest

from posefield.inference.graph_ports import OUTPUTS
from posefield.model_file import subgraph

# Identities are removed when a session loads.
NODES = {"model_path": 77, "labelled_path": 85, "walk_path": 113}


def count_nodes(content):
    """Count the nodes whose values depend on an input, and so are not computed once."""
    graph = onnx.load_from_string(content).graph
    variable = {port.name for port in graph.input}
    found = [n for n in graph.node if n.op_type != "Identity"]
    counted = 0
    for node in found:
        if variable & set(node.input):
            variable |= set(node.output)
            counted += 1
    return counted


@pytest.mark.parametrize("name", NODES)
def test_no_node_is_added_to_a_pose_unnoticed(request, name):
    content = request.getfixturevalue(name).read_bytes()
    # A pose asks for the outputs of every model; contacts cost nothing unless they are asked for.
    content = subgraph.select_outputs(content, *OUTPUTS)
    fixed = subgraph.fix_level(content, 0)
    assert count_nodes(fixed) <= NODES[name]
    # A level that is an input makes each weight's slice a node of every question.
    assert count_nodes(content) > count_nodes(fixed) + 10


def fused_activations(content):
    """Return the activations that onnxruntime-web 1.23 fuses with Gemm, an operator it lacks."""
    graph = onnx.load_from_string(content).graph
    products = {node.output[0] for node in graph.node if node.op_type == "Gemm"}
    activations = ("Relu", "LeakyRelu", "Tanh", "Sigmoid", "Abs", "Elu", "HardSigmoid", "Softplus")
    return [n.name or n.op_type for n in graph.node if n.op_type in activations
            and n.input[0] in products]  # fmt: skip


@pytest.mark.parametrize("name", NODES)
def test_older_browsers_engines_run_every_level(request, name):
    content = request.getfixturevalue(name).read_bytes()
    assert fused_activations(content) == []
    broken = onnx.load_from_string(content)
    product = next(n for n in broken.graph.node if n.op_type == "Gemm")
    broken.graph.node.add(op_type="Relu", input=[product.output[0]], output=["refused"])
    assert fused_activations(broken.SerializeToString()) == ["Relu"]
