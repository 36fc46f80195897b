"""glTF document: its JSON as typed objects of pygltflib, and the arrays in its buffers."""

import struct
import urllib.parse
import urllib.request
import warnings
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
import pygltflib

from posefield.common.errors import MotionFileError
from posefield.common.units import Floats

IGNORED_EXTENSIONS = (
    *("KHR_mesh_quantization", "KHR_materials", "KHR_texture", "EXT_texture", "KHR_lights"),
    *("EXT_lights", "KHR_xmp", "KHR_node_", "MSFT_", "EXT_mesh_", "KHR_draco", "KHR_audio"),
    *("KHR_physics", "KHR_collision", "KHR_rigid", "KHR_implicit_shapes", "OMI_", "MOZ_", "VRM"),
)
"""Beginnings of required extensions that leave joints and animations as they are, or are read."""

MAX_DEPTH = 2000
"""Limit of nodes in one another, of which bones are at most half."""

Beside = Callable[[str], bytes]
"""Function that returns the content of a file beside the document; MotionError if there is none."""


@dataclass(frozen=True)
class GltfDocument:
    """A document.

    source: the file's name. beside: other files. unread: required extensions that may change the
    parts of the document that have them.
    """

    source: str
    parts: Any
    beside: Beside
    unread: frozenset[str]

    def error(self, message: str) -> MotionFileError:
        """Return an error that names the file."""
        return MotionFileError(self.source, message)

    def expect_plain(self, name: str, *objects: Any) -> None:
        """Raise MotionFileError if a required extension may change parts that are needed."""
        for item in objects:
            for extension in sorted(self.unread & (item.extensions or {}).keys()):
                raise self.error(
                    f"{name} requires the extension {extension}, which may change the skeleton or "
                    "its animation: export without it"
                )

    @cached_property
    def above(self) -> dict[int, int]:
        """Return the parent of each node that has one; MotionFileError unless they are trees."""
        parents: dict[int, int] = {}
        count = len(self.parts.nodes)
        for parent, node in enumerate(self.parts.nodes):
            for child in node.children or ():
                if child in parents or not 0 <= child < count:
                    raise self.error(f"node {child} is no child of one node, expected a tree")
                parents[child] = parent
        ended: set[int] = set()
        for node in range(count):
            path, ancestor = {node}, node
            while ancestor in parents and ancestor not in ended:
                ancestor = parents[ancestor]
                if ancestor in path:
                    raise self.error(f"node {ancestor} is its own ancestor, expected a tree")
                path.add(ancestor)
            ended |= path
        return parents

    def ancestors(self, node: int) -> list[int]:
        """Return a node and its ancestors, the scene's root last."""
        path = [node]
        while path[-1] in self.above:
            path.append(self.above[path[-1]])
            if len(path) > MAX_DEPTH:
                raise self.error(f"node {node} lies below more than {MAX_DEPTH} others")
        return path

    def below(self, root: int) -> list[int]:
        """Return a node and its descendants, parents first, in the order of the file."""
        nodes, pending = [], [root]
        while pending:
            node = pending.pop()
            nodes.append(node)
            pending += reversed(self.parts.nodes[node].children or [])
        return nodes

    def common_ancestor(self, nodes: Iterable[int]) -> int | None:
        """Return the last node that is each of the nodes or an ancestor of it, if there is one."""
        shared: list[int] | None = None
        for path in map(self.ancestors, nodes):
            among = set(path)
            shared = path if shared is None else [node for node in shared if node in among]
        return shared[0] if shared else None

    def node_name(self, node: int) -> str:
        """Return the name of a node for messages."""
        return str(self.parts.nodes[node].name or node)

    def buffer(self, index: int) -> bytes:
        """Return the bytes of a buffer; MotionFileError if they are missing or too few."""
        buffer = self.parts.buffers[index]
        if buffer.uri is None and index > 0:
            raise self.error(f"buffer {index} has no content, expected a URI: export uncompressed")
        content = self.parts.binary_blob() if buffer.uri is None else self._resource(buffer.uri)
        content = content or b""
        if len(content) < buffer.byteLength:
            raise self.error(
                f"buffer {index} has {len(content)} bytes, expected {buffer.byteLength}: "
                "the file is not whole"
            )
        return content

    def _resource(self, uri: str) -> bytes:
        if not uri.startswith("data:"):
            return self.beside(urllib.parse.unquote(uri))
        with urllib.request.urlopen(uri) as data:
            content: bytes = data.read()
            return content


def load(content: bytes, source: str, neighbour: Beside) -> GltfDocument:
    """Return the document of a .glb or .gltf file.

    Raises MotionFileError for a broken container, and for JSON that is no glTF 2.0.
    """
    form = pygltflib.GLTF2
    with warnings.catch_warnings():
        # It warns of what it fills in for fields that are null or missing.
        warnings.simplefilter("ignore")
        try:
            is_binary = content[:4] == b"glTF"
            read = form.load_from_bytes if is_binary else form.gltf_from_json
            document = read(content if is_binary else content.decode())
        except (ValueError, RecursionError, OSError, ArithmeticError, struct.error) as fault:
            raise MotionFileError(source, f"not glTF: {fault}") from fault
    version = str(document.asset.version)
    if version.partition(".")[0] != "2":
        raise MotionFileError(source, f"found version {version!r} of glTF, expected 2.0")
    required = map(str, document.extensionsRequired or ())
    unread = frozenset(name for name in required if not name.startswith(IGNORED_EXTENSIONS))
    return GltfDocument(source, document, neighbour, unread)


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
    document.expect_plain(f"accessor {index}", accessor)
    if accessor.type != kind or accessor.componentType not in COMPONENTS:
        raise document.error(
            f"accessor {index} has type {str(accessor.type)[:9]} of {accessor.componentType}, "
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
    document.expect_plain(f"buffer view {index}", view, document.parts.buffers[view.buffer])
    content = document.buffer(view.buffer)
    count, width = shape
    size = width * dtype.itemsize
    stride = view.byteStride or size
    start = (view.byteOffset or 0) + offset
    end = start + (count - 1) * stride + size
    last = min(len(content), (view.byteOffset or 0) + view.byteLength)
    if start < 0 or stride < size or end > last:
        raise document.error(
            f"buffer view {index} ends at byte {last}, expected {count} values up to byte {end}"
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
    sparse_values = sparse.values
    values = _view(
        document, sparse_values.bufferView, sparse_values.byteOffset or 0, raw.dtype, shape
    )
    if rows.max() >= len(raw):
        raise document.error(f"accessor {index} replaces value {rows.max()} of {len(raw)}")
    replaced = raw.copy()
    replaced[rows] = values
    return replaced


def _shares(raw: npt.NDArray[Any]) -> Floats:
    """Return normalized integers as numbers from -1 or 0 to 1."""
    if raw.dtype.kind == "f":
        return raw.astype(np.float64)
    largest = float(np.iinfo(raw.dtype).max)
    return np.maximum(raw.astype(np.float64) / largest, -1.0)
