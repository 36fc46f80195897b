"""Buffer and container of a binary glTF 2.0 file."""

import struct
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt
import orjson

MAGIC, VERSION, TEXT, BINARY = 0x46546C67, 2, 0x4E4F534A, 0x004E4942
VERTICES, CORNERS = 34962, 34963
"""Targets of buffer views, by their OpenGL constants."""
COMPONENTS = {"f4": 5126, "u1": 5121, "u2": 5123, "u4": 5125}


@dataclass(frozen=True)
class GlbBuffer:
    """Binary buffer under construction, with its views and accessors."""

    views: list[dict[str, Any]] = field(default_factory=list)
    accessors: list[dict[str, Any]] = field(default_factory=list)
    parts: list[bytes] = field(default_factory=list)

    def view(self, content: bytes, **said: Any) -> int:
        """Return the index of a new view of bytes, padded to a multiple of four.

        said: further properties of the view.
        """
        last = self.views[-1] if self.views else {"byteOffset": 0, "byteLength": 0}
        start = last["byteOffset"] + _padded_length(last["byteLength"])
        length = len(content)
        self.views.append({"buffer": 0, "byteOffset": start, "byteLength": length, **said})
        self.parts.append(content.ljust(_padded_length(length), b"\0"))
        return len(self.views) - 1

    def accessor(self, array: npt.NDArray[Any], kind: str, view: int, **said: Any) -> int:
        """Return the index of a new accessor with one element per row of the array.

        kind: glTF type such as "VEC3". said: further properties of the accessor.
        """
        component = COMPONENTS[array.dtype.str[1:]]
        found = {"bufferView": view, "componentType": component, "count": len(array), "type": kind}
        self.accessors.append(found | said)
        return len(self.accessors) - 1

    def zeros(self, count: int) -> int:
        """Return the index of an accessor of vectors (count, 3) that are zero, without numbers."""
        ends = {"min": [0.0, 0.0, 0.0], "max": [0.0, 0.0, 0.0]}
        component = COMPONENTS["f4"]
        self.accessors.append({"componentType": component, "count": count, "type": "VEC3"} | ends)
        return len(self.accessors) - 1

    def add(self, array: npt.NDArray[Any], kind: str, **said: Any) -> int:
        """Return the index of an accessor of a whole array; said: properties of its view."""
        return self.accessor(array, kind, self.view(array.tobytes(), **said))

    def add_bounded(self, array: npt.NDArray[Any], kind: str, **said: Any) -> int:
        """Return the index of an accessor of a whole array, with minimum and maximum.

        glTF requires them for positions and times. said: properties of its view.
        """
        flat = array.reshape(len(array), -1)
        ends = {"min": flat.min(axis=0).tolist(), "max": flat.max(axis=0).tolist()}
        return self.accessor(array, kind, self.view(array.tobytes(), **said), **ends)


def smallest_index_type(count: int) -> type[np.unsignedinteger[Any]]:
    """Return the smallest unsigned type for `count` values; glTF reserves the largest one."""
    kinds = (np.uint8, np.uint16, np.uint32)
    return next(kind for kind in kinds if count <= np.iinfo(kind).max)


def asset(facts: dict[str, Any]) -> dict[str, Any]:
    """Return the asset of a document; facts: provenance, stored in `extras.posefield`."""
    return {"version": "2.0", "generator": "posefield", "extras": {"posefield": facts}}


def container(document: dict[str, Any], store: GlbBuffer) -> bytes:
    """Return the file of a document and its buffer."""
    binary = b"".join(store.parts)
    held = {
        "bufferViews": store.views,
        "accessors": store.accessors,
        "buffers": [{"byteLength": len(binary)}],
    }
    text = orjson.dumps(document | held)
    text = text.ljust(_padded_length(len(text)))
    total = 12 + 8 + len(text) + 8 + len(binary)
    return b"".join(
        (
            struct.pack("<3L", MAGIC, VERSION, total),
            struct.pack("<2L", len(text), TEXT),
            text,
            struct.pack("<2L", len(binary), BINARY),
            binary,
        )
    )


def _padded_length(length: int) -> int:
    return length + -length % 4
