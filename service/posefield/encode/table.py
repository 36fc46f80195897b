"""Tables of arrays and facts, and their encoding as JSON, MessagePack, NPZ and Arrow.

Poses, clips, crowds and grids are tables, so that each format has one encoder.

NPZ archives have the bytes of zipfile and numpy.save for the same arrays, in a quarter of their
time: members are stored, so their sizes and checksums are known beforehand, and arrays are copied
once. Arrow streams have one record batch, whose tensor columns have the canonical extension type
`arrow.fixed_shape_tensor`: a reader has each column as one array (N, ...) without parsing. The
schema's metadata are JSON texts under keys like the card's.
"""

import io
import json
import math
import struct
import zlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache, lru_cache
from typing import Any

import msgspec
import nanoarrow
import numpy as np
import numpy.typing as npt
import orjson
from nanoarrow.ipc import StreamWriter

from posefield.common import cancellation
from posefield.model_file.model_card import PREFIX

Column = npt.NDArray[Any]
JSON_BLOCK = 16_384
"""Numbers that are written at a time: a millisecond, in which no other thread runs."""


@dataclass(frozen=True)
class Table:
    """Arrays by name, in the order and types of the file, and facts.

    columns: arrays (N, ...) of equally many rows. fixed: other arrays, which hold for all rows.
    facts: strings, numbers, lists and objects.
    """

    columns: Mapping[str, Column]
    facts: Mapping[str, Any]
    fixed: Mapping[str, Column] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))

    @property
    def arrays(self) -> dict[str, Column]:
        """Return all arrays, columns and fixed ones."""
        return {**self.columns, **self.fixed}


def as_float32(values: npt.NDArray[Any]) -> Column:
    """Return an array as float32, the precision of the model."""
    return np.ascontiguousarray(values, dtype=np.float32)


def json_table(table: Table) -> bytes:
    """Return one JSON object, arrays as nested lists."""
    return json_object({**table.facts, **table.arrays})


def json_object(content: Mapping[str, Any]) -> bytes:
    """Return a JSON object of plain values and arrays, large ones written a few rows at a time.

    orjson holds Python's lock while it writes, a tenth of a second for 16 MB.
    """
    members = (orjson.dumps(name) + b":" + _json_value(value) for name, value in content.items())
    return b"{" + b",".join(members) + b"}"


def _json_value(value: Any) -> bytes:
    if not isinstance(value, np.ndarray) or value.size <= JSON_BLOCK:
        return orjson.dumps(value, option=orjson.OPT_SERIALIZE_NUMPY)
    rows, pieces = max(1, JSON_BLOCK * len(value) // value.size), []
    for first in range(0, len(value), rows):
        cancellation.check()
        block = orjson.dumps(value[first : first + rows], option=orjson.OPT_SERIALIZE_NUMPY)
        # Without the brackets of the block.
        pieces.append(block[1:-1])
    return b"[" + b",".join(pieces) + b"]"


def msgpack_table(table: Table) -> bytes:
    """Return one MessagePack map; an array is a map of dtype, shape and its little-endian bytes.

    As lists the same numbers would take five bytes each, and longer to read than from JSON.
    """
    return _MSGPACK.encode(
        {**table.facts, **{k: _msgpack_array(v) for k, v in table.arrays.items()}}
    )


_MSGPACK = msgspec.msgpack.Encoder()


def _msgpack_array(values: Column) -> dict[str, Any]:
    contiguous = np.ascontiguousarray(values)
    little_endian = contiguous.astype(contiguous.dtype.newbyteorder("<"), copy=False)
    return {
        "dtype": little_endian.dtype.str,
        "shape": list(contiguous.shape),
        "data": little_endian.tobytes(),
    }


# The earliest time of the zip format, so that the bytes depend on the arrays alone.
TIME, DATE = 0, 0x21
VERSION, UNIX = 20, 3
READABLE_MODE = 0o644 << 16
LOCAL_HEADER = struct.Struct("<4s5H3L2H")
CENTRAL_HEADER = struct.Struct("<4s2B5H3L5H2L")
END_RECORD = struct.Struct("<4s4H2LH")
MAX_BYTES = 0xFFFFFFFE
"""Largest size of an archive; the next larger value refers to a record of Zip64."""


def npz_table(table: Table) -> bytes:
    """Return an archive of the arrays and the facts of a table.

    Strings, numbers and lists of either are arrays too; other facts are JSON texts. Raises
    ValueError as `npz_archive` does.
    """
    facts = {name: _npz_array(value) for name, value in table.facts.items()}
    return npz_archive({**table.arrays, **facts})


def _npz_array(value: Any) -> Column:
    if isinstance(value, str | float):
        return np.array(value)
    if isinstance(value, list) and all(isinstance(text, str) for text in value):
        return np.array(value, dtype=np.str_)
    if isinstance(value, list) and all(isinstance(text, int) for text in value):
        return np.array(value, dtype=np.int32)
    return np.array(orjson.dumps(value).decode())


def npz_archive(arrays: Mapping[str, npt.NDArray[Any]]) -> bytes:
    """Return an archive of stored members; ValueError for more than 4 GB."""
    pieces, index, at = list[Any](), list[bytes](), 0
    for label, values in arrays.items():
        # As numpy.save: an array whose columns lie together is written in that order.
        array = values.T if values.flags.fnc else values
        head = array_header(values.dtype, values.shape, values.flags.fnc)
        name = f"{label}.npy".encode("ascii")
        data = np.ascontiguousarray(array).reshape(-1).view(np.uint8).data
        size = len(head) + len(data)
        if at + size > MAX_BYTES:
            raise ValueError(f"{at + size} bytes up to {label}, expected at most {MAX_BYTES}")
        crc = zlib.crc32(data, zlib.crc32(head))
        common = (0, 0, TIME, DATE, crc, size, size, len(name), 0)
        local = LOCAL_HEADER.pack(b"PK\3\4", VERSION, *common)
        pieces += local, name, head, data
        made_by = VERSION, UNIX, VERSION
        index += CENTRAL_HEADER.pack(b"PK\1\2", *made_by, *common, 0, 0, 0, READABLE_MODE, at), name
        at += len(local) + len(name) + size
    central = b"".join(index)
    end = END_RECORD.pack(b"PK\5\6", 0, 0, len(arrays), len(arrays), len(central), at, 0)
    return b"".join((*pieces, central, end))


def array_file(value: Any) -> bytes:
    """Return an .npy file of a fact, as an archive has it."""
    array = _npz_array(value)
    return array_header(array.dtype, array.shape, False) + array.tobytes()


@lru_cache(maxsize=256)
def array_header(dtype: np.dtype[Any], shape: tuple[int, ...], columns_first: bool) -> bytes:
    """Return the head of an .npy file of version 1.0."""
    stream = io.BytesIO()
    described = np.lib.format.dtype_to_descr(dtype)
    content = {"descr": described, "fortran_order": columns_first, "shape": shape}
    np.lib.format.write_array_header_1_0(stream, content)
    return stream.getvalue()


_TYPES = {
    "float32": nanoarrow.float32,
    "float64": nanoarrow.float64,
    "int8": nanoarrow.int8,
    "int32": nanoarrow.int32,
    "bool": nanoarrow.bool_,
}


def arrow_stream(table: Table) -> bytes:
    """Return the Arrow IPC stream of a table; equal tables give equal bytes."""
    pieces = _ChunkList()
    write_arrow([table], pieces)
    return b"".join(pieces)


def write_arrow(blocks: Iterable[Table], file: Any) -> None:
    """Write tables of equal columns and facts as one Arrow IPC stream, a record batch for each."""
    schema = None
    with StreamWriter.from_writable(file) as writer:
        for table in blocks:
            if schema is None:
                kinds = tuple((name, _kind(column)) for name, column in table.columns.items())
                schema = nanoarrow.c_schema(_rows(kinds)).modify(metadata=_metadata(table))
            children = [_arrow_array(column) for column in table.columns.values()]
            writer.write_stream(
                nanoarrow.c_array_from_buffers(schema, len(table), [None], children=children)
            )


def _metadata(table: Table) -> dict[str, str]:
    options = orjson.OPT_SERIALIZE_NUMPY | orjson.OPT_SORT_KEYS
    metadata = {**table.facts, **table.fixed}
    return {PREFIX + key: orjson.dumps(metadata[key], option=options).decode() for key in metadata}


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


def _arrow_array(column: Column) -> Any:
    """Return the column as an Arrow array on the same memory."""
    numbers, shape = _kind(column)
    # One bit for each boolean: nanoarrow would take NumPy's bytes for bits.
    buffer = np.packbits(column, bitorder="little") if numbers == "bool" else column.reshape(-1)
    array = nanoarrow.c_array_from_buffers(_storage(numbers), column.size, [None, buffer])
    if not shape:
        return array
    kind = _list_storage(numbers, math.prod(shape))
    return nanoarrow.c_array_from_buffers(kind, len(column), [None], children=[array])


@cache
def _storage(numbers: str) -> Any:
    return nanoarrow.c_schema(_TYPES[numbers](nullable=False))


@lru_cache(maxsize=256)
def _list_storage(numbers: str, size: int) -> Any:
    return nanoarrow.c_schema(_list_type(numbers, size))
