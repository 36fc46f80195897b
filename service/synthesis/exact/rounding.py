"""How this machine rounds where answers are corrected: by NumPy, and not by the graph."""

from functools import cache

import numpy as np

# Rows and columns that fill no register, so that their ends show too.
ROWS, COLUMNS = 29, 37


@cache
def mark() -> bytes:
    """A product, a solution and a sine of the same numbers everywhere: kinds of processor that
    round otherwise differ in them."""
    numbers = np.sin(np.arange(1.0, ROWS * COLUMNS + 1.0)).reshape(ROWS, COLUMNS)
    square = numbers @ numbers.T + np.eye(ROWS)
    return b"".join(a.tobytes() for a in (square, np.linalg.solve(square, numbers), numbers))
