"""glTF document: its JSON as typed objects of pygltflib, and the bytes of its buffers."""

import base64
import binascii
import json
import struct
import urllib.parse
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import pygltflib

from posefield.common.errors import MotionFileError

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
    unread = [name for name in facts.get("extensionsRequired", []) if not _is_harmless(name)]
    if unread:
        raise MotionFileError(
            source,
            f"requires the extensions {', '.join(map(str, unread))}, expected none that compress "
            "or replace animations: export it without",
        )
    return GltfDocument(source, _parse(text), binary, beside)


def _is_harmless(name: Any) -> bool:
    return name in READ_EXTENSIONS or str(name).startswith(IGNORED_PREFIXES)


def _parse(text: bytes) -> Any:
    """Return the objects of pygltflib."""
    with warnings.catch_warnings():
        # It warns of what it fills in for fields that are null or missing.
        warnings.simplefilter("ignore")
        return pygltflib.GLTF2.gltf_from_json(text.decode())


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
