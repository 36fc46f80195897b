"""Tables as Arrow IPC streams of one record batch.

Tensor columns have the canonical extension type `arrow.fixed_shape_tensor`: a reader has each
column as one array (N, ...) without parsing. The schema's metadata are JSON texts under keys like
the card's.
"""

import json
import math
from functools import cache, lru_cache
from typing import Any

import nanoarrow
import numpy as np
import orjson
from nanoarrow.ipc import StreamWriter

from posefield.encode.tables.table import Column, Table
from posefield.model_file.model_card import PREFIX

_TYPES = {
    "float32": nanoarrow.float32,
    "float64": nanoarrow.float64,
    "int8": nanoarrow.int8,
    "bool": nanoarrow.bool_,
}


def arrow_stream(table: Table) -> bytes:
    """Return the Arrow IPC stream of a table; equal tables give equal bytes."""
    kinds = tuple((name, _kind(column)) for name, column in table.columns.items())
    schema = nanoarrow.c_schema(_rows(kinds)).modify(metadata=_metadata(table))
    batch = nanoarrow.c_array_from_buffers(
        schema, len(table), [None], children=[_array(c) for c in table.columns.values()]
    )
    pieces = _ChunkList()
    with StreamWriter.from_writable(pieces) as writer:
        writer.write_stream(batch)
    return b"".join(pieces)


def _metadata(table: Table) -> dict[str, str]:
    options = orjson.OPT_SERIALIZE_NUMPY | orjson.OPT_SORT_KEYS
    said = {**table.facts, **table.fixed}
    return {PREFIX + key: orjson.dumps(said[key], option=options).decode() for key in said}


class _ChunkList(list[bytes]):
    """Writable list of the written chunks.

    Three times as fast as a BytesIO, which reallocates its buffer as it grows.
    """

    def write(self, piece: memoryview) -> int:
        self.append(bytes(piece))
        return len(piece)


Kind = tuple[str, tuple[int, ...]]
"""Type of the numbers of a column, and the shape of a row. Types of kinds are cached: nanoarrow
takes as long to build them as to write a crowd of a hundred characters."""


def _kind(column: Column) -> Kind:
    return column.dtype.name, column.shape[1:]


@lru_cache(maxsize=64)
def _rows(kinds: tuple[tuple[str, Kind], ...]) -> Any:
    """Return the type of rows with columns of these names and kinds."""
    return nanoarrow.struct({name: _field(*kind) for name, kind in kinds}, nullable=False)


def _field(numbers: str, shape: tuple[int, ...]) -> Any:
    if not shape:
        return _TYPES[numbers](nullable=False)
    # Without spaces, as other writers have it.
    metadata = json.dumps({"shape": list(shape)}, separators=(",", ":"))
    return nanoarrow.extension_type(
        _list_type(numbers, math.prod(shape)), "arrow.fixed_shape_tensor", metadata, nullable=False
    )


def _list_type(numbers: str, size: int) -> Any:
    return nanoarrow.fixed_size_list(_TYPES[numbers](nullable=False), size, nullable=False)


def _array(column: Column) -> Any:
    """Return the column as an Arrow array on the same memory."""
    numbers, shape = _kind(column)
    # One bit for each boolean: nanoarrow would take NumPy's bytes for bits.
    buffer = np.packbits(column, bitorder="little") if numbers == "bool" else column.reshape(-1)
    made = nanoarrow.c_array_from_buffers(_storage(numbers), column.size, [None, buffer])
    if not shape:
        return made
    kind = _list_storage(numbers, math.prod(shape))
    return nanoarrow.c_array_from_buffers(kind, len(column), [None], children=[made])


@cache
def _storage(numbers: str) -> Any:
    return nanoarrow.c_schema(_TYPES[numbers](nullable=False))


@lru_cache(maxsize=256)
def _list_storage(numbers: str, size: int) -> Any:
    return nanoarrow.c_schema(_list_type(numbers, size))
