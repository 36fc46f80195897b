"""Tests of the ONNX check: files of posefield pass, other content is refused by name."""

import functools

import model_files
import onnx
import pytest
from hypothesis import given
from hypothesis import strategies as st

from posefield.common.errors import ModelError
from posefield.model_file import checked_file, onnx_file
from posefield_train.kriging.kriging_graph import COVARIANCES
from posefield_train.onnx_graph import GraphBuilder

MODELS = ("model_path", "labelled_path", "walk_path", "measured_walk_path")


@pytest.fixture
def model(model_path):
    """The good model, to be changed."""
    return onnx.load(model_path)


def refusal(model):
    content = model if isinstance(model, bytes) else model.SerializeToString()
    with pytest.raises(ValueError) as caught:
        onnx_file.check(content)
    return str(caught.value)


def weight(model, name):
    return next(tensor for tensor in model.graph.initializer if tensor.name == name)


def covariance(formula):
    """A graph of one covariance, as the exporter writes it."""
    net = GraphBuilder()
    net.add_output("near", formula.onnx(net, "squared"))
    content = net.model({"squared": ["n"]}, {"near": ["n"]}, {}, {"producer_name": "posefield"})
    return onnx.load_from_string(content)


@pytest.fixture(scope="module")
def written(request):
    """Everything that the exporter writes: trained models, and every covariance."""
    models = [onnx.load(request.getfixturevalue(name)) for name in MODELS]
    return [*models, *map(covariance, COVARIANCES.values())]


def used(message):
    """Fields that messages have, as `onnx_file.MODEL` tells them."""
    found = {}
    for field, value in message.ListFields():
        inners = value if hasattr(value, "__len__") else [value]
        inner = [used(one) for one in inners] if field.message_type else []
        found[field.number] = functools.reduce(merged, inner, found.get(field.number, {}))
    return found


def merged(one, other):
    both = {number: merged(one.get(number, {}), other.get(number, {})) for number in one | other}
    return dict(sorted(both.items()))


def test_operators_are_those_that_the_exporter_writes_and_no_others(written):
    assert {node.op_type for model in written for node in model.graph.node} == onnx_file.OPERATORS


def test_fields_are_those_that_the_exporter_writes_and_no_others(written):
    assert functools.reduce(merged, map(used, written)) == onnx_file.MODEL


@pytest.mark.parametrize("name", MODELS)
def test_what_is_found_is_what_onnx_finds(name, request):
    content = request.getfixturevalue(name).read_bytes()
    model, found = onnx.load_from_string(content), onnx_file.check(content)
    metadata = {entry.key: entry.value.encode() for entry in model.metadata_props}
    assert found.metadata == metadata
    assert found.shapes == {t.name: tuple(t.dims) for t in model.graph.initializer}
    assert found.values == {name for node in model.graph.node for name in node.output}


def test_a_loop_is_refused(model_path):
    looping = onnx.load_from_string(model_files.loop(model_path.read_bytes()))
    assert (
        refusal(looping) == "it has a field 7.1.5.6 of onnx.proto, which posefield does not write"
    )
    looping.graph.node[-1].ClearField("attribute")
    assert refusal(looping) == "its graph has an operator 'Loop', which posefield does not use"


@pytest.mark.parametrize(
    ("change", "field"),
    [
        (lambda m: m.graph.node.add(op_type="Add", domain="com.microsoft"), "7.1.7"),
        (lambda m: m.functions.add(name="f"), "25"),
        (lambda m: m.graph.sparse_initializer.add(), "7.15"),
        (lambda m: m.graph.initializer[0].external_data.add(key="location"), "7.5.13"),
        (lambda m: m.graph.initializer[0].float_data.append(1.0), "7.5.4"),
    ],
)
def test_other_fields_are_refused_by_number(model, change, field):
    change(model)
    assert refusal(model) == (
        f"it has a field {field} of onnx.proto, which posefield does not write"
    )


def test_fields_of_a_second_graph_are_checked_too(model):
    """Readers of protocol buffers merge it with the first one."""
    content = model.SerializeToString()
    second = onnx.ModelProto(graph=onnx.GraphProto(node=[onnx.NodeProto(op_type="Loop")]))
    assert "operator 'Loop'" in refusal(content + second.SerializeToString())


@pytest.mark.parametrize(
    "shape", [[1, 2], [2**40, 2**40, 0], [-1], [2**62, 4], [2**63 - 1, 2**63 - 1]]
)
def test_a_constant_of_another_shape_than_its_bytes_is_refused(model_path, shape):
    model = onnx.load(model_path)
    weight(model, "core").dims[:] = shape
    with pytest.raises(ModelError):
        checked_file.load_card(model_files.written(model), "some.onnx")


def test_a_key_that_stands_twice_is_refused(model):
    model.metadata_props.append(model.metadata_props[0])
    assert refusal(model) == "two of its metadata entries have one key"


@given(st.lists(st.integers(0, 2**63 - 1)), st.text(), st.integers(0, 2**31 - 1))
def test_what_google_writes_is_read(axes, name, kind):
    tensor = onnx.TensorProto(dims=axes, name=name, data_type=kind)
    found = list(onnx_file.wire_fields(tensor.SerializeToString()))
    assert [field.value for field in found if field.number == 1] == axes
    assert [field.value for field in found if field.number == 2] == [kind]
    assert [field.content.decode() for field in found if field.number == 8] == [name]
    assert b"".join(field.encoded for field in found) == tensor.SerializeToString()


@given(st.integers(0, 2**31 - 1), st.binary(max_size=300), st.text())
def test_google_reads_what_is_written(kind, numbers, name):
    content = (
        onnx_file.encode_varint(2, kind)
        + onnx_file.encode_bytes(9, numbers)
        + onnx_file.encode_bytes(8, name.encode())
    )
    tensor = onnx.TensorProto.FromString(content)
    assert (tensor.data_type, tensor.raw_data, tensor.name) == (kind, numbers, name)


@given(st.binary(max_size=200))
def test_any_bytes_are_fields_or_refused(content):
    try:
        found = list(onnx_file.wire_fields(content))
    except ValueError:
        return
    assert b"".join(field.encoded for field in found) == content


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"\x0a\x05abc", "field 1 takes 5 bytes, and 3 follow"),
        (b"\x0a\xff\xff\xff\xff\xff\xff\xff\xff\xff\x01abc", "field 1 takes 18446744073709551615"),
        (b"\x08\x80", "a number at byte 1 does not end"),
        (b"\x08" + b"\xff" * 11, "a number at byte 1 does not end"),
        (b"\x00\x00", "a field 0 at byte 0, expected 1 or more"),
        (b"\x0b\x0c", "field 1 has wire type 3, expected 0, 1, 2 or 5"),
    ],
)
def test_a_message_that_is_cut_or_none_is_refused(content, said):
    with pytest.raises(ValueError, match=said):
        list(onnx_file.wire_fields(content))
