"""Tests of the checksum at the end of a file: every single-bit change is detected."""

import hashlib

import onnx

from posefield.model_file import checked_file

CONTENT = bytes(range(256)) * 4


def test_a_sealed_file_holds_and_begins_as_before():
    whole = checked_file.append_checksum(CONTENT)
    assert checked_file.has_valid_checksum(whole)
    assert whole[: -checked_file.CHECKSUM_SIZE] == CONTENT
    assert whole.endswith(hashlib.sha256(CONTENT).hexdigest().encode())
    assert checked_file.has_valid_checksum(checked_file.append_checksum(b""))


def test_every_bit_counts():
    whole = checked_file.append_checksum(CONTENT)
    for place in range(8 * len(whole)):
        damaged = bytearray(whole)
        damaged[place // 8] ^= 1 << place % 8
        assert not checked_file.has_valid_checksum(bytes(damaged))


def test_the_checksum_is_metadata_of_an_onnx_file(model_path):
    """Other engines read past it."""
    content = model_path.read_bytes()
    model = onnx.load_from_string(content)
    onnx.checker.check_model(model, full_check=True)
    last = model.metadata_props[-1]
    assert last.key == checked_file.CHECKSUM_KEY.decode()
    assert last.value == hashlib.sha256(content[: -checked_file.CHECKSUM_SIZE]).hexdigest()
    assert model.SerializeToString(deterministic=True) == content
