"""Numbers as JSON holds them: rounded to six digits, more than anything here is worth."""

from typing import Any

import numpy as np
import numpy.typing as npt


def number(value: Any) -> float:
    """One number."""
    return float(f"{float(value):.6g}")


def numbers(values: npt.ArrayLike) -> Any:
    """Nested lists of the numbers of an array."""
    array = np.asarray(values, dtype=np.float64)
    return [numbers(row) for row in array] if array.ndim else number(array)
