"""Accessors of a glTF document: arrays of numbers, plain, normalized, strided or sparse."""

from typing import Any

import numpy as np
import numpy.typing as npt

from posefield.common.units import Floats
from posefield.rigs.gltf.gltf_document import GltfDocument

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
