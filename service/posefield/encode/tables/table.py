"""Tables of arrays and facts, and their encoding as JSON, MessagePack and npz.

Poses, clips, crowds and grids are tables, so that each format has one encoder.
"""

import io
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import msgspec
import numpy as np
import numpy.typing as npt
import orjson

from posefield.common import cancellation

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
    own = np.ascontiguousarray(values)
    plain = own.astype(own.dtype.newbyteorder("<"), copy=False)
    return {"dtype": plain.dtype.str, "shape": list(own.shape), "data": plain.tobytes()}


def npz_table(table: Table) -> bytes:
    """Return an archive that numpy.load opens without pickle.

    Strings, numbers and lists of either are arrays too; other facts are JSON texts.
    """
    facts = {name: _array(value) for name, value in table.facts.items()}
    return npz_archive({**table.arrays, **facts})


def _array(value: Any) -> Column:
    if isinstance(value, str | float):
        return np.array(value)
    if isinstance(value, list) and all(isinstance(each, str) for each in value):
        return np.array(value, dtype=np.str_)
    if isinstance(value, list) and all(isinstance(each, int) for each in value):
        return np.array(value, dtype=np.int32)
    return np.array(orjson.dumps(value).decode())


# The earliest time of the zip format, so that the bytes depend on the arrays alone.
MODIFICATION_TIME = (1980, 1, 1, 0, 0, 0)
READABLE_MODE = 0o644 << 16


def npz_archive(arrays: Mapping[str, npt.NDArray[Any]]) -> bytes:
    """Return an archive of stored members that numpy.load opens without pickle."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_STORED) as made:
        for name, values in arrays.items():
            with made.open(_member(name), "w") as file:
                np.lib.format.write_array(file, values, allow_pickle=False)
    return stream.getvalue()


def _member(name: str) -> zipfile.ZipInfo:
    member: Any = zipfile.ZipInfo(f"{name}.npy", MODIFICATION_TIME)
    member.create_system, member.external_attr = 3, READABLE_MODE
    return member
