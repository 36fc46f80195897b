"""A file is opened only if it can be trusted; otherwise the error says which file and why."""

import hashlib
import json
from itertools import product

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper

from service.motion.errors import ModelError
from service.synthesis import session
from service.synthesis.ports import OUTPUTS


@pytest.fixture
def graph(model_path):
    """The good model, to be damaged on purpose."""
    return onnx.load(model_path)


@pytest.fixture
def refused(tmp_path):
    """Function that expects a graph or bytes to be refused and gives the reason."""
    path = tmp_path / "damaged.onnx"

    def of(content):
        path.write_bytes(content if isinstance(content, bytes) else content.SerializeToString())
        with pytest.raises(ModelError) as caught:
            session.load(path)
        assert caught.value.path == str(path)
        assert str(caught.value) == f"{path}: {caught.value.message}"
        return caught.value.message

    return of


def entry(graph, key):
    return next(prop for prop in graph.metadata_props if prop.key == f"posefield.{key}")


def weight(graph, name):
    return next(tensor for tensor in graph.graph.initializer if tensor.name == name)


def test_a_good_file_opens_and_its_digest_is_that_of_its_bytes(model_path):
    opened = session.load(model_path)
    assert opened.digest == hashlib.sha256(model_path.read_bytes()).hexdigest()[:16]
    assert opened.card.name == "reaching"


def test_the_same_graph_written_again_still_opens(graph):
    """Negative control of all below: it is the damage that is refused, not the rewriting."""
    content = graph.SerializeToString()
    assert session.open_bytes(content, "again").card.name == "reaching"


def test_a_model_runs_on_one_thread_and_the_cpu(model_path):
    runtime = session.load(model_path).runtimes[0]
    options = runtime.get_session_options()
    assert (options.intra_op_num_threads, options.inter_op_num_threads) == (1, 1)
    assert runtime.get_providers() == ["CPUExecutionProvider"]


def test_outputs_come_in_the_order_asked_for(model_path):
    opened = session.load(model_path)
    point = np.array([[c.default for c in opened.card.controls]])
    times = np.array([[0.0, 0.5, 1.0]])
    sigma, rotations = opened.run(point, times, "sigma", "rotations")
    assert sigma.shape == (1,) and rotations.shape == (1, 3, 33, 4)
    assert {array.dtype for array in (sigma, rotations)} == {np.dtype(np.float32)}


def test_durations_alone_are_those_of_the_whole_graph(labelled_path, rng):
    """To the last bit: a clip's end that an answer named is not beyond the end."""
    opened = session.load(labelled_path)
    low, high = ([getattr(c, e) for c in opened.card.controls] for e in ("minimum", "maximum"))
    points, times = rng.uniform(low, high, (200, len(low))), np.zeros((1, 1))
    for level, labels in product(range(4), (np.zeros((1, 3)), np.eye(3)[:1])):
        asked = [(point[None], labels, level) for point in points]
        alone = np.array([opened.durations(*question)[0] for question in asked])
        whole = [opened.run(p, times, "duration", labels=w, level=n)[0][0] for p, w, n in asked]
        assert np.array_equal(alone, whole)
        assert np.ptp(alone) > 0.01


def test_durations_alone_are_a_part_of_the_graph(model_path):
    clock = session.load(model_path).clocks[0]
    assert [port.name for port in clock.get_inputs()] == ["controls"]
    assert [port.name for port in clock.get_outputs()] == ["duration"]


def test_an_empty_file_is_refused(refused):
    assert refused(b"").startswith("onnxruntime cannot load it: ")


@pytest.mark.parametrize("content", [b"not a model at all", bytes(range(256)) * 8, b"\0" * 4096])
def test_a_file_of_something_else_is_refused(refused, content):
    assert refused(content)


@pytest.mark.parametrize("share", [0.1, 0.5, 0.99])
def test_a_truncated_file_is_refused(refused, model_path, share):
    content = model_path.read_bytes()
    assert refused(content[: int(share * len(content))])


def test_a_message_is_one_line(refused):
    assert "\n" not in refused(b"not a model at all")


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(ModelError, match=r"none\.onnx: cannot be read: No such file"):
        session.load(tmp_path / "none.onnx")


def test_a_folder_is_refused(tmp_path):
    with pytest.raises(ModelError, match="cannot be read: Is a directory"):
        session.load(tmp_path)


def test_a_foreign_model_is_refused(refused):
    ports = [helper.make_tensor_value_info(name, TensorProto.FLOAT, [1]) for name in ("in", "out")]
    node = helper.make_node("Identity", ["in"], ["out"])
    foreign = helper.make_graph([node], "foreign", ports[:1], ports[1:])
    opsets = [helper.make_opsetid("", 18)]
    model = helper.make_model(foreign, opset_imports=opsets, ir_version=8)
    onnx.checker.check_model(model)
    assert refused(model) == "no posefield metadata: it was not written by posefield"


def test_a_model_without_its_metadata_is_refused(refused, graph):
    del graph.metadata_props[:]
    assert refused(graph) == "no posefield metadata: it was not written by posefield"


@pytest.mark.parametrize("number", ["1", "0", '"1"', "null"])
def test_another_format_is_refused(refused, graph, number):
    entry(graph, "format").value = number
    found = json.loads(number)
    assert refused(graph) == f"model format {found}, this version reads format 2"


@pytest.mark.parametrize("key", ["controls", "skeleton", "durations", "levels", "name"])
def test_an_incomplete_card_is_refused(refused, graph, key):
    graph.metadata_props.remove(entry(graph, key))
    assert refused(graph) == f"incomplete posefield metadata: '{key}'"


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("controls", "7"),
        ("controls", '[{"name": "speed"}]'),
        ("controls", "[]"),
        ("skeleton", "[]"),
        ("skeleton", "{"),
        ("levels", "null"),
        ("format", "one"),
    ],
)
def test_a_card_that_makes_no_sense_is_refused(refused, graph, key, value):
    entry(graph, key).value = value
    assert refused(graph)


def test_a_skeleton_that_is_no_tree_is_refused(refused, graph):
    plain = json.loads(entry(graph, "skeleton").value)
    plain["parents"][1] = 5
    entry(graph, "skeleton").value = json.dumps(plain)
    assert "every parent before its children" in refused(graph)


def test_a_skeleton_of_other_joints_than_the_graph_is_refused(refused, graph):
    plain = json.loads(entry(graph, "skeleton").value)
    cut = {key: plain[key][:-1] for key in ("names", "parents", "offsets")}
    cut |= {"tip_joints": plain["tip_joints"][:-1], "tip_offsets": plain["tip_offsets"][:-1]}
    entry(graph, "skeleton").value = json.dumps(cut)
    assert refused(graph) == "rotations (1, 1, 33, 4), expected (1, 1, 32, 4)"


def test_fewer_controls_than_the_graph_takes_are_refused(refused, graph):
    plain = json.loads(entry(graph, "controls").value)
    entry(graph, "controls").value = json.dumps(plain[:-1])
    assert refused(graph).startswith("does not run: ")


@pytest.mark.parametrize("port", ["controls", "time", *OUTPUTS])
def test_a_port_of_another_name_is_refused(refused, graph, port):
    renamed = onnx.compose.add_prefix_graph(graph.graph, "")
    for ports in (renamed.input, renamed.output):
        for value in ports:
            value.name = "other" if value.name == port else value.name
    for node in renamed.node:
        for names in (node.input, node.output):
            names[:] = ["other" if name == port else name for name in names]
    graph.graph.CopyFrom(renamed)
    message = refused(graph)
    assert "'other'" in message and f"'{port}'" in message.partition("expected")[2]


def test_a_port_too_many_is_refused(refused, graph):
    extra = helper.make_tensor_value_info("style", TensorProto.FLOAT, ["batch", "styles"])
    graph.graph.input.append(extra)
    assert refused(graph).startswith("inputs (name: axes) {")


def test_a_port_of_other_axes_is_refused(refused, graph):
    """Rotations as one long row: legal ONNX, but nothing that a clip could be made of."""
    flat = helper.make_node("Flatten", ["rotations"], ["row"], axis=1)
    graph.graph.node.append(flat)
    output = graph.graph.output[0]
    assert output.name == "rotations"
    for node in graph.graph.node:
        for names in (node.input, node.output):
            swap = {"rotations": "unflat", "row": "rotations"}
            names[:] = [swap.get(name, name) for name in names]
    output.CopyFrom(helper.make_tensor_value_info("rotations", TensorProto.FLOAT, ["b", "n"]))
    assert "'rotations': 2" in refused(graph)


@pytest.mark.parametrize("name", ["core", "root_mean", "offset_mean", "mean_rotations"])
def test_weights_that_are_no_numbers_are_refused(refused, graph, name):
    tensor = weight(graph, name)
    damaged = numpy_helper.to_array(tensor).copy()
    damaged[...] = np.nan
    tensor.CopyFrom(numpy_helper.from_array(damaged, name))
    assert refused(graph) == "answers with numbers that are not finite"


def test_an_error_names_what_bytes_were_said_to_be():
    with pytest.raises(ModelError, match=r"^upload\.onnx: onnxruntime cannot load it"):
        session.open_bytes(b"nothing", "upload.onnx")
