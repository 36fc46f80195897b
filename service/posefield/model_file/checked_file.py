"""Reading of model files: limited in size, and checked before onnxruntime opens them.

docs/decisions/0022-model-file-checks.md states the purpose of each check.

The last entry of a file is the SHA-256 of all bytes before it, one of ONNX's `metadata_props`. A
protocol buffer may be extended at its end, so every ONNX engine reads the file, and the checksum is
verified without parsing: the last `CHECKSUM_SIZE` bytes must be those that `append_checksum` would
append to the bytes before them. The card is read from JSON texts to typed values with bounds.
"""

import hashlib
import os
import stat
from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, Literal, NotRequired, TypedDict, get_type_hints

import msgspec
import numpy as np

from posefield.common.bounded_types import Count, Degree, Name, NonNegative, Number, Share, Text
from posefield.common.errors import ModelError
from posefield.common.units import Floats
from posefield.model_file import card_check, onnx_file
from posefield.model_file.model_card import FORMAT, OPTIONAL_ENTRIES, PREFIX, UNITS, ModelCard
from posefield.roles.joint_recognition import standing

CHECKSUM_KEY = b"posefield_sha256"

# Field 14 of ModelProto, and fields 1 and 2 of StringStringEntryProto in onnx.proto. All lengths
# are below 128, so each takes one byte.
_PROPERTY, _KEY, _VALUE = b"\x72", b"\x0a", b"\x12"
_HEAD = _KEY + bytes([len(CHECKSUM_KEY)]) + CHECKSUM_KEY + _VALUE + bytes([64])
_HEAD = _PROPERTY + bytes([len(_HEAD) + 64]) + _HEAD
CHECKSUM_SIZE = len(_HEAD) + 64
"""Bytes of the entry."""


def append_checksum(content: bytes) -> bytes:
    """Return an ONNX file, which must not have a checksum yet, with its checksum appended."""
    return content + _checksum_entry(memoryview(content))


def has_valid_checksum(content: bytes) -> bool:
    """Return whether a file ends with the checksum of the bytes before it."""
    return content[-CHECKSUM_SIZE:] == _checksum_entry(memoryview(content)[:-CHECKSUM_SIZE])


def _checksum_entry(content: memoryview) -> bytes:
    return _HEAD + hashlib.sha256(content).hexdigest().encode()


MAX_CARD_BYTES = 4 << 20
"""Largest size of all texts together. A card of 50 clips has 9 kB, and each further clip adds about
100 bytes.
"""

Triple = tuple[Number, Number, Number]
Units = TypedDict("Units", {name: Literal[unit] for name, unit in UNITS.items()})  # type: ignore


class Compression(TypedDict):
    """Size of the raw tensor relative to the core, and relative to all stored numbers."""

    core: NonNegative
    stored: NonNegative


class LabelParameters(TypedDict):
    """Parameters of one label set: correlation between two names, and variance of offsets."""

    correlation: NonNegative
    offset: NonNegative


class ContactAccuracy(TypedDict):
    """Leave-one-take-out errors of contacts, over clips, canonical frames and joints.

    agreement: share of right contacts. brier: mean squared error of their probabilities.
    climatology: the same of the mean over the other takes.
    """

    agreement: Share
    brier: NonNegative
    climatology: NonNegative


class DetailFacts(TypedDict):
    """Size of the sampled detail, and accelerations over that of captured clips.

    acceleration: of left-out predictions. sampled: of the same with detail.
    """

    harmonics: Count
    directions: Count
    acceleration: NonNegative
    sampled: NonNegative


class Diagnostics(TypedDict):
    """Errors (m), sizes and parameters, written by `posefield_train.graph.onnx_export`."""

    truncation_rms_m: NonNegative
    truncation_p99_m: NonNegative
    truncation_max_m: NonNegative
    truncation_effector_m: NotRequired[NonNegative]
    compression: Compression
    leave_one_out_rms_m: NonNegative
    explained: Mapping[Name, Number]
    covariance: Name
    drift: tuple[Degree, ...]
    scales: tuple[NonNegative, ...]
    nugget: NonNegative
    trend: NonNegative
    labels: Mapping[Name, LabelParameters]
    tensor: tuple[Count, Count, Count]
    parity_m: NonNegative
    detail: NotRequired[DetailFacts]
    notes: tuple[Text, ...]
    contacts: NotRequired[ContactAccuracy]


class Adaptation(TypedDict):
    """Record of one performer that was added to a trained model."""

    parent_sha256: Name
    performer: Name
    clips: Count
    data_sha256: Name
    licence: Text


class Provenance(TypedDict):
    """Data and program versions that a model was made with."""

    licence: Text
    recipe_sha256: Name
    data_sha256: Name
    clips: Count
    versions: Mapping[Name, Name]
    adapted: NotRequired[tuple[Adaptation, ...]]


OPTIONAL = dict.fromkeys(OPTIONAL_ENTRIES, b"[]") | dict.fromkeys(
    ("captured_acceleration", "robot"), b"null"
)
"""Entries that a file may lack, and the text that stands for them."""

_TYPES = get_type_hints(ModelCard, include_extras=True) | {
    "diagnostics": Diagnostics,
    "provenance": Provenance,
}


def decode_card(entries: Mapping[str, bytes]) -> ModelCard:
    """Return the card from a file's metadata entries; entries of other producers are ignored.

    Raises ValueError, which names the entry, the path, the value found and the value expected.
    """
    texts = {key: text for key, text in entries.items() if key.startswith(PREFIX)}
    _check_format(texts)
    if (size := sum(map(len, texts.values()))) > MAX_CARD_BYTES:
        raise ValueError(f"its card has {size} bytes, expected at most {MAX_CARD_BYTES}")
    _decode_entry(texts, "units", Units)
    card = ModelCard(
        **{f.name: _decode_entry(texts, f.name, _TYPES[f.name]) for f in fields(ModelCard)}
    )
    card_check.check(card)
    return card


def _check_format(texts: Mapping[str, bytes]) -> None:
    version = texts.get(f"{PREFIX}format")
    if version is None:
        raise ValueError("no posefield metadata: it was not written by posefield")
    if version != str(FORMAT).encode():
        quoted = version[:40].decode(errors="replace")
        raise ValueError(f"model format {quoted}, this version reads format {FORMAT}")


def _decode_entry(texts: Mapping[str, bytes], name: str, kind: Any) -> Any:
    text = texts.get(PREFIX + name, OPTIONAL.get(name))
    if text is None:
        raise ValueError(f"its card has no entry {name!r}")
    try:
        return msgspec.json.decode(text, type=kind, dec_hook=_decode_array)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as fault:
        raise ValueError(f"its card's entry {name!r} is wrong: {fault}") from fault


ROWS = {2: tuple[Number, Number], 4: tuple[Number, Number, Number, Number]}
"""Rows of arrays of other sizes than three, by size."""


def _decode_array(kind: Any, value: Any) -> Floats:
    """Return an array of numbers (n,), or of rows of equal length (n, 2 to 4); none are triples."""
    rows = isinstance(value, list) and all(isinstance(row, list) for row in value)
    size = len(value[0]) if rows and value else 3
    row: Any = ROWS.get(size, Triple)
    numbers = msgspec.convert(value, list[row] if rows else list[Number])
    return np.array(numbers, dtype=np.float64).reshape((-1, size) if rows else -1)


MAX_BYTES = 64 << 20
"""Largest size of a file. A model of 92 clips has 110 kB, one of 2,000 about 20 MB."""
NO_CHECKSUM = (
    "does not end with its checksum: it is damaged, another program has written it, or it is older "
    "than checksums; expected a file as posefield wrote it"
)


def read(path: Path) -> bytes:
    """Return the content of a model file; ModelError if it cannot be read or is too large."""

    def opener(name: str, flags: int) -> int:
        # A named pipe would wait for its writer.
        return os.open(name, flags | os.O_NONBLOCK)

    try:
        with open(path, "rb", opener=opener) as it:
            facts = os.fstat(it.fileno())
            if not stat.S_ISREG(facts.st_mode):
                raise ModelError(path, "cannot be read: not a regular file")
            check_size(facts.st_size, path)
            return it.read(facts.st_size)
    except OSError as fault:
        raise ModelError(path, f"cannot be read: {fault.strerror}") from fault


def check_size(size: int, source: str | Path) -> None:
    """Raise ModelError for a size above MAX_BYTES."""
    if size > MAX_BYTES:
        raise ModelError(source, f"cannot be read: {size} bytes, expected at most {MAX_BYTES}")


def load_card(content: bytes, source: str) -> ModelCard:
    """Return the card of a file with a valid checksum, graph and card; ModelError for any other.

    Its skeleton stands on the floor at the origin, wherever the file has its root. source: path or
    URL of the file, for messages.
    """
    check_size(len(content), source)
    if not has_valid_checksum(content):
        raise ModelError(source, NO_CHECKSUM)
    try:
        onnx = onnx_file.check(content)
        card = decode_card(onnx.metadata)
        card_check.check_graph(card, onnx.shapes, onnx.values)
    except (ValueError, OverflowError) as fault:
        raise ModelError(source, str(fault)) from fault
    return replace(card, skeleton=standing(card.skeleton))


def sha256(content: bytes) -> str:
    """Return the SHA-256 of a model file in hexadecimal digits."""
    return hashlib.sha256(content).hexdigest()


def digest(content: bytes) -> str:
    """Return the first 16 digits of the SHA-256, which identify a version of a model."""
    return sha256(content)[:16]
