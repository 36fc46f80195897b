"""glTF document: its JSON as typed objects of pygltflib, and the arrays in its buffers."""

import base64
import binascii
import json
import struct
import urllib.parse
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pygltflib

from posefield.common.errors import MotionFileError
from posefield.common.units import Floats

MAGIC, VERSION = b"glTF", 2
JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942
HEADER, CHUNK = struct.Struct("<4sII"), struct.Struct("<II")
READ_EXTENSIONS = {"KHR_mesh_quantization", "KHR_texture_transform"}
"""Required extensions that change neither nodes nor animations, or that are read."""
IGNORED_PREFIXES = ("KHR_materials", "KHR_texture", "KHR_lights", "KHR_xmp", "EXT_texture")
"""Required extensions of materials, textures and lights, which a motion does not need."""

Beside = Callable[[str], bytes]
"""Function that returns the content of a file beside the document; MotionError if there is none."""


@dataclass(frozen=True)
class GltfDocument:
    """A document. source: the file's name. binary: the chunk of a GLB file. beside: other files."""

    source: str
    parts: Any
    binary: bytes
    beside: Beside

    def error(self, message: str) -> MotionFileError:
        """Return an error that names the file."""
        return MotionFileError(self.source, message)

    def buffer(self, index: int) -> bytes:
        """Return the bytes of a buffer; MotionFileError if they are missing or too few."""
        own = self.parts.buffers[index]
        content = self.binary if own.uri is None else self._resource(own.uri)
        if len(content) < own.byteLength:
            raise self.error(
                f"buffer {index} has {len(content)} bytes, expected {own.byteLength}: the file is "
                "not whole"
            )
        return content

    def _resource(self, uri: str) -> bytes:
        if not uri.startswith("data:"):
            return self.beside(urllib.parse.unquote(uri))
        head, _, text = uri.partition(",")
        if not head.endswith(";base64"):
            raise self.error("found a data URI without base64, expected base64")
        try:
            return base64.b64decode(text, validate=True)
        except binascii.Error as fault:
            raise self.error(f"found a data URI that is no base64: {fault}") from fault


def load(content: bytes, source: str, beside: Beside) -> GltfDocument:
    """Return the document of a .glb or .gltf file.

    Raises MotionFileError for a broken container, JSON that is no glTF 2.0, and a required
    extension that may change the motion.
    """
    text, binary = _chunks(content, source) if content[:4] == MAGIC else (content, b"")
    try:
        facts = json.loads(text)
    except (ValueError, RecursionError) as fault:
        raise MotionFileError(source, f"not glTF: {fault}") from fault
    version = facts.get("asset", {}).get("version") if isinstance(facts, dict) else None
    if not isinstance(version, str) or version.partition(".")[0] != str(VERSION):
        raise MotionFileError(source, f"found version {version!r} of glTF, expected 2.0")
    unread = [
        name
        for name in facts.get("extensionsRequired", [])
        if name not in READ_EXTENSIONS and not str(name).startswith(IGNORED_PREFIXES)
    ]
    if unread:
        raise MotionFileError(
            source,
            f"requires the extensions {', '.join(map(str, unread))}, expected none that compress "
            "or replace animations: export it without",
        )
    with warnings.catch_warnings():
        # It warns of what it fills in for fields that are null or missing.
        warnings.simplefilter("ignore")
        parts = pygltflib.GLTF2.gltf_from_json(text.decode())
    return GltfDocument(source, parts, binary, beside)


def _chunks(content: bytes, source: str) -> tuple[bytes, bytes]:
    """Return JSON and binary chunk of a GLB file."""
    if len(content) < HEADER.size:
        raise MotionFileError(source, f"found {len(content)} bytes, expected a GLB file")
    _, version, length = HEADER.unpack_from(content)
    if version != VERSION or length > len(content):
        raise MotionFileError(
            source,
            f"found version {version} and {len(content)} of {length} bytes, expected a whole file "
            f"of version {VERSION}",
        )
    found: dict[int, bytes] = {}
    place = HEADER.size
    while place + CHUNK.size <= length:
        size, kind = CHUNK.unpack_from(content, place)
        place += CHUNK.size
        found.setdefault(kind, content[place : place + size])
        place += size
    if JSON_CHUNK not in found:
        raise MotionFileError(source, "found no JSON chunk, expected one")
    return found[JSON_CHUNK], found.get(BINARY_CHUNK, b"")


COMPONENTS: dict[int, npt.DTypeLike] = {
    5120: np.int8,
    5121: np.uint8,
    5122: np.int16,
    5123: np.uint16,
    5125: np.uint32,
    5126: np.float32,
}
"""Types of numbers by their code, little endian."""
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
MAX_NUMBERS = 20_000_000
"""Limit of an accessor's numbers: 11 hours of a joint's rotations at 120 frames a second."""


def numbers(document: GltfDocument, index: int, kind: str) -> Floats:
    """Return the values of an accessor as (count, width) doubles; normalized integers as shares.

    kind: its type, such as "VEC3". Raises MotionFileError for another type, for values outside
    their buffer, and for numbers that are not finite.
    """
    accessor = _item(document, document.parts.accessors, index, "accessor")
    if accessor.type != kind or accessor.componentType not in COMPONENTS:
        raise document.error(
            f"accessor {index} has type {accessor.type} of {accessor.componentType}, "
            f"expected {kind}"
        )
    dtype, width = np.dtype(COMPONENTS[accessor.componentType]).newbyteorder("<"), WIDTHS[kind]
    if not 0 < accessor.count * width <= MAX_NUMBERS:
        raise document.error(
            f"accessor {index} has {accessor.count} values, expected 1 to {MAX_NUMBERS // width}"
        )
    shape = (accessor.count, width)
    if accessor.bufferView is None:
        raw = np.zeros(shape, dtype)
    else:
        raw = _view(document, accessor.bufferView, accessor.byteOffset or 0, dtype, shape)
    if accessor.sparse is not None:
        raw = _with_sparse(document, raw, accessor.sparse, index)
    values = _shares(raw) if accessor.normalized else raw.astype(np.float64)
    if not np.all(np.isfinite(values)):
        raise document.error(f"accessor {index} has numbers that are not finite")
    return values


def _item(document: GltfDocument, items: Any, index: int, what: str) -> Any:
    """Return an item of a list; MotionFileError if the list is shorter."""
    if not isinstance(index, int) or not 0 <= index < len(items):
        raise document.error(f"names {what} {index}, but has {len(items)}")
    return items[index]


def _view(
    document: GltfDocument, index: int, offset: int, dtype: np.dtype[Any], shape: tuple[int, int]
) -> npt.NDArray[Any]:
    """Return (count, width) numbers from a place in a buffer view."""
    view = _item(document, document.parts.bufferViews, index, "buffer view")
    _item(document, document.parts.buffers, view.buffer, "buffer")
    content = document.buffer(view.buffer)
    count, width = shape
    size = width * dtype.itemsize
    stride = view.byteStride or size
    start = (view.byteOffset or 0) + offset
    end = start + (count - 1) * stride + size
    most = min(len(content), (view.byteOffset or 0) + view.byteLength)
    if start < 0 or stride < size or end > most:
        raise document.error(
            f"buffer view {index} ends at byte {most}, expected {count} values up to byte {end}"
        )
    return np.ndarray(shape, dtype, content, start, (stride, dtype.itemsize))


def _with_sparse(
    document: GltfDocument, raw: npt.NDArray[Any], sparse: Any, index: int
) -> npt.NDArray[Any]:
    """Return values with those that a sparse accessor replaces."""
    if sparse.indices.componentType not in (5121, 5123, 5125):
        raise document.error(f"accessor {index} has indices of {sparse.indices.componentType}")
    kind = np.dtype(COMPONENTS[sparse.indices.componentType]).newbyteorder("<")
    where = sparse.indices
    rows = _view(document, where.bufferView, where.byteOffset or 0, kind, (sparse.count, 1))[:, 0]
    shape = (sparse.count, raw.shape[1])
    own = sparse.values
    values = _view(document, own.bufferView, own.byteOffset or 0, raw.dtype, shape)
    if rows.max() >= len(raw):
        raise document.error(f"accessor {index} replaces value {rows.max()} of {len(raw)}")
    replaced = raw.copy()
    replaced[rows] = values
    return replaced


def _shares(raw: npt.NDArray[Any]) -> Floats:
    """Return normalized integers as numbers from -1 or 0 to 1."""
    if raw.dtype.kind == "f":
        return raw.astype(np.float64)
    most = float(np.iinfo(raw.dtype).max)
    return np.maximum(raw.astype(np.float64) / most, -1.0)
