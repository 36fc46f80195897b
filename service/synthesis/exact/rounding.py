"""Fingerprint of this machine's rounding in NumPy, with which corrections are computed."""

from functools import cache

import numpy as np

# Sizes that are no multiple of a register, so that remainders are covered.
ROWS, COLUMNS = 29, 37


@cache
def mark() -> bytes:
    """Return a matrix product, a solution and sines of fixed numbers as bytes.

    They differ between processors whose rounding differs.
    """
    numbers = np.sin(np.arange(1.0, ROWS * COLUMNS + 1.0)).reshape(ROWS, COLUMNS)
    square = numbers @ numbers.T + np.eye(ROWS)
    return b"".join(a.tobytes() for a in (square, np.linalg.solve(square, numbers), numbers))
