"""Tests of opening model files: errors give the file and the reason."""

import hashlib
from itertools import product

import numpy as np
import onnx
import pytest
from model_files import written
from onnx import TensorProto, helper, numpy_helper

from posefield.common.errors import ModelError
from posefield.inference import onnx_runtime, session
from posefield.inference.onnx_runtime import OUTPUTS


@pytest.fixture
def graph(model_path):
    """The good model, to be damaged on purpose."""
    return onnx.load(model_path)


@pytest.fixture
def refused(tmp_path):
    """Function that expects a graph with its checksum, or bytes, to be refused; the reason."""
    path = tmp_path / "damaged.onnx"

    def of(content):
        path.write_bytes(content if isinstance(content, bytes) else written(content))
        with pytest.raises(ModelError) as caught:
            session.load(path)
        assert caught.value.path == str(path)
        assert str(caught.value) == f"{path}: {caught.value.message}"
        return caught.value.message

    return of


def weight(graph, name):
    return next(tensor for tensor in graph.graph.initializer if tensor.name == name)


def test_a_good_file_opens_and_its_digest_is_that_of_its_bytes(model_path):
    opened = session.load(model_path)
    assert opened.digest == hashlib.sha256(model_path.read_bytes()).hexdigest()[:16]
    assert opened.card.name == "reaching"


def test_the_same_graph_written_again_still_opens(graph):
    """Negative control of all below: it is the change that is refused, not the rewriting."""
    assert session.load_bytes(written(graph), "again").card.name == "reaching"
    assert session.open_bytes(written(graph), "again").card.name == "reaching"


def test_a_model_runs_on_one_thread_and_the_cpu(model_path):
    runtime = onnx_runtime.open_session(model_path.read_bytes(), "reaching")
    options = runtime.get_session_options()
    assert (options.intra_op_num_threads, options.inter_op_num_threads) == (1, 1)
    assert runtime.get_providers() == ["CPUExecutionProvider"]


def test_durations_alone_are_those_of_the_whole_graph(labelled_path, rng):
    """To the last bit: a clip's end that an answer named is not beyond the end."""
    opened = session.load(labelled_path)
    low, high = ([getattr(c, e) for c in opened.card.controls] for e in ("minimum", "maximum"))
    points, times = rng.uniform(low, high, (200, len(low))), np.zeros((1, 1))
    for level, labels in product(range(4), (np.zeros((1, 3)), np.eye(3)[:1])):
        inputs = {"labels": labels, "level": level}
        alone = [opened.run(point[None], None, "duration", **inputs)[0][0] for point in points]
        outputs = ("rotations", "duration")
        whole = [opened.run(point[None], times, *outputs, **inputs)[1][0] for point in points]
        assert np.array_equal(alone, whole)
        assert np.ptp(alone) > 0.01


@pytest.mark.parametrize("port", ["controls", "time", *list(OUTPUTS)[:1]])
def test_a_port_of_another_name_is_refused(refused, graph, port):
    for ports in (graph.graph.input, graph.graph.output):
        for value in ports:
            value.name = "other" if value.name == port else value.name
    for node in graph.graph.node:
        for names in (node.input, node.output):
            names[:] = ["other" if name == port else name for name in names]
    assert port in refused(graph)


def test_a_port_of_other_axes_is_refused(refused, graph):
    """Rotations as one long row: legal ONNX, but nothing that a clip could be made of."""
    graph.graph.initializer.append(numpy_helper.from_array(np.array([-1, 132]), "rows"))
    graph.graph.node.append(helper.make_node("Reshape", ["rotations", "rows"], ["row"]))
    output = graph.graph.output[0]
    assert output.name == "rotations"
    for node in graph.graph.node:
        for names in (node.input, node.output):
            swap = {"rotations": "unflat", "row": "rotations"}
            names[:] = [swap.get(name, name) for name in names]
    output.CopyFrom(helper.make_tensor_value_info("rotations", TensorProto.FLOAT, ["b", "n"]))
    assert refused(graph) == "rotations (85, 132), expected (17, 5, 33, 4)"


def test_answers_that_mix_rows_are_refused(refused, graph):
    """One sigma for two questions: a single question would not show it."""
    for node in graph.graph.node:
        node.output[:] = ["own" if name == "sigma" else name for name in node.output]
    graph.graph.node.append(helper.make_node("ReduceSum", ["own"], ["sigma"], keepdims=1))
    assert refused(graph) == "sigma (1,), expected (17,)"


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("core", np.nan, "its core are not all numbers up to 1e+09 in size"),
        ("sill", np.inf, "its sill are not all numbers"),
        ("pose_weights", 1e30, "its pose_weights are not all numbers"),
        ("pose_weights", 1e6, "its root_position is"),
        ("offset_mean", 1e3, "its bone_offsets is 1e+03 m, expected -"),
        ("root_mean", -1e6, "its root_position is -1e+06 m, expected -"),
        ("mean_rotations", 0.0, "its rotations are not of length 1"),
        ("duration_weights", 1e6, "its duration are not finite numbers"),
    ],
)
def test_weights_that_no_training_makes_are_refused(refused, graph, name, value, said):
    tensor = weight(graph, name)
    damaged = np.full_like(numpy_helper.to_array(tensor), value)
    tensor.CopyFrom(numpy_helper.from_array(damaged, name))
    assert refused(graph).startswith(said)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("duration", "its duration is 0 s, expected 0.2"),
        ("sigma", "its sigma is 0 at all captured"),
    ],
)
def test_an_output_of_no_size_is_refused(refused, graph, name, said):
    for node in graph.graph.node:
        node.output[:] = ["own" if output == name else output for output in node.output]
    graph.graph.node.append(helper.make_node("Sub", ["own", "own"], [name]))
    assert refused(graph).startswith(said)
