"""Tables of arrays and facts, and their encoding as JSON and MessagePack.

Poses, clips, crowds and grids are tables, so that each format has one encoder.
"""

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
