"""Crowd poses as an Arrow IPC stream of one record batch, one row a character.

Rows hold tensors by the canonical extension `arrow.fixed_shape_tensor`: a reader has each column as
one array (N, ...) without parsing. The schema's metadata are JSON texts under keys like the card's.
"""

import json
from typing import Any

import nanoarrow
from nanoarrow.ipc import StreamWriter

from service.encode import crowd_poses
from service.encode.crowd_poses import Column
from service.motion.card import PREFIX
from service.motion.crowd import CrowdPoses

_TYPES = {"float32": nanoarrow.float32, "int8": nanoarrow.int8}


def arrow(poses: CrowdPoses) -> bytes:
    """Arrow IPC stream; the same poses always give the same bytes."""
    table = crowd_poses.columns(poses)
    rows = nanoarrow.struct({n: _field(c) for n, c in table.items()}, nullable=False)
    metadata = {PREFIX + key: value for key, value in crowd_poses.fact_texts(poses).items()}
    schema = nanoarrow.c_schema(rows).modify(metadata=metadata)
    batch = nanoarrow.c_array_from_buffers(
        schema, len(poses), [None], children=[_array(c) for c in table.values()]
    )
    pieces = _Pieces()
    with StreamWriter.from_writable(pieces) as writer:
        writer.write_stream(batch)
    return b"".join(pieces)


class _Pieces(list[bytes]):
    """Keeps what is written: a BytesIO would grow for the last bytes, and take thrice as long."""

    def write(self, piece: memoryview) -> int:
        self.append(bytes(piece))
        return len(piece)


def _field(column: Column) -> Any:
    shape = list(column.shape[1:])
    if not shape:
        return _type(column)
    # Without spaces, as other writers have it.
    metadata = json.dumps({"shape": shape}, separators=(",", ":"))
    return nanoarrow.extension_type(
        _rows(column), "arrow.fixed_shape_tensor", metadata, nullable=False
    )


def _array(column: Column) -> Any:
    """Column as Arrow holds it, on the same memory."""
    numbers = nanoarrow.c_array(column.reshape(-1), _type(column))
    if column.ndim == 1:
        return numbers
    return nanoarrow.c_array_from_buffers(_rows(column), len(column), [None], children=[numbers])


def _rows(column: Column) -> Any:
    return nanoarrow.fixed_size_list(_type(column), column[0].size, nullable=False)


def _type(column: Column) -> Any:
    return _TYPES[column.dtype.name](nullable=False)
