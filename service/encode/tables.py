"""Numbers for programs: a table and what is said of it, as JSON, MessagePack and npz.

What holds a form together is here once: a pose, a clip, a crowd and a grid are tables.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import msgspec
import numpy as np
import numpy.typing as npt
import orjson

from service.encode import arrays

Column = npt.NDArray[Any]


@dataclass(frozen=True)
class Table:
    """Arrays by name in the order and types in which they travel, and plain values.

    columns: arrays (N, ...) of as many rows. fixed: arrays that are no rows, but hold for all.
    facts: strings, numbers, lists and objects.
    """

    columns: Mapping[str, Column]
    facts: Mapping[str, Any]
    fixed: Mapping[str, Column] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))

    @property
    def arrays(self) -> dict[str, Column]:
        """All arrays, whatever their rows."""
        return {**self.columns, **self.fixed}


def single(values: npt.NDArray[Any]) -> Column:
    """The same as float32, which is what the model answers and takes half the digits."""
    return np.ascontiguousarray(values, dtype=np.float32)


def json(table: Table) -> bytes:
    """One JSON object, arrays as nested lists."""
    return orjson.dumps({**table.facts, **table.arrays}, option=orjson.OPT_SERIALIZE_NUMPY)


def msgpack(table: Table) -> bytes:
    """One MessagePack map; an array is a map of dtype, shape and its little-endian bytes.

    As lists the same numbers take five bytes each, and longer to read than JSON's.
    """
    return _MSGPACK.encode({**table.facts, **{k: _packed(v) for k, v in table.arrays.items()}})


_MSGPACK = msgspec.msgpack.Encoder()


def _packed(values: Column) -> dict[str, Any]:
    own = np.ascontiguousarray(values)
    plain = own.astype(own.dtype.newbyteorder("<"), copy=False)
    return {"dtype": plain.dtype.str, "shape": list(own.shape), "data": plain.tobytes()}


def npz(table: Table) -> bytes:
    """Archive that numpy.load opens without pickle.

    Strings, numbers and lists of either are arrays too; other facts are JSON texts.
    """
    facts = {name: _array(value) for name, value in table.facts.items()}
    return arrays.archive({**table.arrays, **facts})


def _array(value: Any) -> Column:
    if isinstance(value, str | float):
        return np.array(value)
    if isinstance(value, list) and all(isinstance(each, str) for each in value):
        return np.array(value, dtype=np.str_)
    if isinstance(value, list) and all(isinstance(each, int) for each in value):
        return np.array(value, dtype=np.int32)
    return np.array(orjson.dumps(value).decode())
