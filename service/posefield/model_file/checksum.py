"""Checksum of a model file: its last entry is the SHA-256 of all bytes before it.

The entry is one of ONNX's `metadata_props`. A protocol buffer may be extended at its end, so every
ONNX engine reads the file, and the checksum is verified without parsing: the last `SIZE` bytes must
be those that `append_checksum` would append to the bytes before them.
"""

import hashlib

KEY = b"posefield_sha256"

# Field 14 of ModelProto, and fields 1 and 2 of StringStringEntryProto in onnx.proto. All lengths
# are below 128, so each takes one byte.
_PROPERTY, _KEY, _VALUE = b"\x72", b"\x0a", b"\x12"
_HEAD = _KEY + bytes([len(KEY)]) + KEY + _VALUE + bytes([64])
_HEAD = _PROPERTY + bytes([len(_HEAD) + 64]) + _HEAD
SIZE = len(_HEAD) + 64
"""Bytes of the entry."""


def append_checksum(content: bytes) -> bytes:
    """Return an ONNX file, which must not have a checksum yet, with its checksum appended."""
    return content + _entry(memoryview(content))


def is_valid(content: bytes) -> bool:
    """Return whether a file ends with the checksum of the bytes before it."""
    return content[-SIZE:] == _entry(memoryview(content)[:-SIZE])


def _entry(content: memoryview) -> bytes:
    return _HEAD + hashlib.sha256(content).hexdigest().encode()
