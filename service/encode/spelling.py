"""Numbers in the syntax of USD text.

usd-core formats each number by itself, orjson a whole array. Both write the fewest digits that
identify the number in its precision, and differ in few forms: 1.0 for 1, and the use of exponents.
"""

import numpy as np
import orjson

from service.encode.content import Array
from service.motion.conventions import Floats, Singles

LARGEST = 1e13
"""Smallest number that orjson writes with an exponent; usd-core starts later."""
SMALLEST = 1e-5
"""Largest float64 below which orjson writes an exponent; usd-core starts later."""


def plain(values: Array) -> bool:
    """Return whether orjson and usd-core agree on all numbers; they do not on NaN and infinity."""
    sizes = np.abs(values)
    small = values.dtype == np.float64 and np.any((sizes < SMALLEST) & (sizes > 0))
    return not small and bool(np.all(sizes < LARGEST))


def array(values: Array) -> bytes:
    """Return vectors (N, 3) in float32 or matrices (N, 4, 4) in float64, in square brackets."""
    if values.ndim == 2:
        return b"[(%b)]" % vectors(values[None])[0]
    return b"[%b]" % b", ".join(b"( (%b) )" % rows for rows in vectors(values))


def moves(rows: Singles) -> list[bytes]:
    """Return the text of each row of vectors (F, N, 3).

    If all but the first vector are constant, those are formatted once.
    """
    if rows.shape[1] == 1 or np.any(rows[:, 1:] != rows[:1, 1:]):
        return vectors(rows)
    (same,) = vectors(rows[:1, 1:])
    return [b"%b), (%b" % (first, same) for first in vectors(rows[:, :1])]


def quaternions(rows: Singles) -> list[bytes]:
    """Return the text of each row of quaternions (F, N, 4).

    The real part is last in the array and first in the text.
    """
    return vectors(rows[..., [3, 0, 1, 2]])


def vectors(rows: Singles | Floats) -> list[bytes]:
    """Return the text of each row of (F, N, n) without the outer brackets: `1, 2), (3, 4`."""
    data = orjson.dumps(np.ascontiguousarray(rows), option=orjson.OPT_SERIALIZE_NUMPY)
    if np.any(rows == np.trunc(rows)):
        data = data.replace(b".0,", b",").replace(b".0]", b"]")
    data = data.replace(b",", b", ").replace(b"], [", b"), (")
    return data[3:-3].split(b"]), ([")
