"""Numbers for JSON, rounded to six significant digits."""

from typing import Any

import numpy as np
import numpy.typing as npt


def round_number(value: Any) -> float:
    """Return a number rounded to six significant digits."""
    return float(f"{float(value):.6g}")


def round_numbers(values: npt.ArrayLike) -> Any:
    """Return an array as nested lists of rounded numbers."""
    array = np.asarray(values, dtype=np.float64)
    return [round_numbers(row) for row in array] if array.ndim else round_number(array)
