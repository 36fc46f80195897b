"""Reader of a model card: JSON texts to typed values with bounds."""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any, Literal, NotRequired, TypedDict, get_type_hints

import msgspec
import numpy as np

from posefield.common.bounded_types import Count, Degree, Name, NonNegative, Number, Share, Text
from posefield.common.units import Floats
from posefield.model_file import card_check
from posefield.model_file.model_card import FORMAT, OPTIONAL_ENTRIES, PREFIX, UNITS, ModelCard

MAX_BYTES = 4 << 20
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


OPTIONAL = dict.fromkeys(OPTIONAL_ENTRIES, b"[]") | {"captured_acceleration": b"null"}
"""Entries that a file may lack, and the text that stands for them."""

_TYPES = get_type_hints(ModelCard, include_extras=True) | {
    "diagnostics": Diagnostics,
    "provenance": Provenance,
}


def decode(entries: Mapping[str, bytes]) -> ModelCard:
    """Return the card from a file's metadata entries; entries of other producers are ignored.

    Raises ValueError, which names the entry, the path, the value found and the value expected.
    """
    own = {key: text for key, text in entries.items() if key.startswith(PREFIX)}
    _check_format(own)
    if (size := sum(map(len, own.values()))) > MAX_BYTES:
        raise ValueError(f"its card has {size} bytes, expected at most {MAX_BYTES}")
    _decode_entry(own, "units", Units)
    card = ModelCard(
        **{f.name: _decode_entry(own, f.name, _TYPES[f.name]) for f in fields(ModelCard)}
    )
    card_check.check(card)
    return card


def _check_format(own: Mapping[str, bytes]) -> None:
    found = own.get(f"{PREFIX}format")
    if found is None:
        raise ValueError("no posefield metadata: it was not written by posefield")
    if found != str(FORMAT).encode():
        shown = found[:40].decode(errors="replace")
        raise ValueError(f"model format {shown}, this version reads format {FORMAT}")


def _decode_entry(own: Mapping[str, bytes], name: str, kind: Any) -> Any:
    text = own.get(PREFIX + name, OPTIONAL.get(name))
    if text is None:
        raise ValueError(f"its card has no entry {name!r}")
    try:
        return msgspec.json.decode(text, type=kind, dec_hook=_decode_array)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as fault:
        raise ValueError(f"its card's entry {name!r} is wrong: {fault}") from fault


def _decode_array(kind: Any, found: Any) -> Floats:
    """Return an array of numbers (n,), or of triples (n, 3)."""
    rows = isinstance(found, list) and all(isinstance(row, list) for row in found)
    numbers = msgspec.convert(found, list[Triple] if rows else list[Number])
    return np.array(numbers, dtype=np.float64).reshape((-1, 3) if rows else -1)
