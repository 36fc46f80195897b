"""Numbers as USD text has them.

usd-core spells each number on its own, orjson a whole array. Both write the fewest digits that mean
the number in its precision, and differ in few forms: 1.0 for 1, and where exponents begin.
"""

import numpy as np
import orjson

from service.encode.content import Array
from service.motion.conventions import Floats, Singles

LARGEST = 1e13
"""Orjson takes exponents from there on, usd-core later."""
SMALLEST = 1e-5
"""Orjson takes exponents below it in double precision, usd-core later."""


def plain(values: Array) -> bool:
    """Whether both spell the numbers alike; they do not those that are none."""
    sizes = np.abs(values)
    small = values.dtype == np.float64 and np.any((sizes < SMALLEST) & (sizes > 0))
    return not small and bool(np.all(sizes < LARGEST))


def array(values: Array) -> bytes:
    """Vectors (N, 3) in single or matrices (N, 4, 4) in double precision, in square brackets."""
    if values.ndim == 2:
        return b"[(%b)]" % vectors(values[None])[0]
    return b"[%b]" % b", ".join(b"( (%b) )" % rows for rows in vectors(values))


def moves(rows: Singles) -> list[bytes]:
    """Each row of vectors (F, N, 3); where all but the first vector stay, they are spelt once."""
    if rows.shape[1] == 1 or np.any(rows[:, 1:] != rows[:1, 1:]):
        return vectors(rows)
    (same,) = vectors(rows[:1, 1:])
    return [b"%b), (%b" % (first, same) for first in vectors(rows[:, :1])]


def quaternions(rows: Singles) -> list[bytes]:
    """Each row of quaternions (F, N, 4), real part last; in text it is the first."""
    return vectors(rows[..., [3, 0, 1, 2]])


def vectors(rows: Singles | Floats) -> list[bytes]:
    """Each row of (F, N, n) plain numbers without the outer brackets: `1, 2), (3, 4`."""
    data = orjson.dumps(np.ascontiguousarray(rows), option=orjson.OPT_SERIALIZE_NUMPY)
    if np.any(rows == np.trunc(rows)):
        data = data.replace(b".0,", b",").replace(b".0]", b"]")
    data = data.replace(b",", b", ").replace(b"], [", b"), (")
    return data[3:-3].split(b"]), ([")
