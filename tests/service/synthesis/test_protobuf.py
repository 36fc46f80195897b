"""Tests of the protobuf wire format against Google's library."""

import onnx
import pytest
from hypothesis import given
from hypothesis import strategies as st

from posefield.model_file import protobuf_wire


@given(st.lists(st.integers(0, 2**63 - 1)), st.text(), st.integers(0, 2**31 - 1))
def test_what_google_writes_is_read(axes, name, kind):
    tensor = onnx.TensorProto(dims=axes, name=name, data_type=kind)
    found = list(protobuf_wire.fields(tensor.SerializeToString()))
    assert [field.value for field in found if field.number == 1] == axes
    assert [field.value for field in found if field.number == 2] == [kind]
    assert [field.content.decode() for field in found if field.number == 8] == [name]
    assert b"".join(field.encoded for field in found) == tensor.SerializeToString()


@given(st.integers(0, 2**31 - 1), st.binary(max_size=300), st.text())
def test_google_reads_what_is_written(kind, numbers, name):
    content = (
        protobuf_wire.encode_varint(2, kind)
        + protobuf_wire.encode_bytes(9, numbers)
        + protobuf_wire.encode_bytes(8, name.encode())
    )
    tensor = onnx.TensorProto.FromString(content)
    assert (tensor.data_type, tensor.raw_data, tensor.name) == (kind, numbers, name)


@given(st.binary(max_size=200))
def test_any_bytes_are_fields_or_refused(content):
    try:
        found = list(protobuf_wire.fields(content))
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
        list(protobuf_wire.fields(content))
