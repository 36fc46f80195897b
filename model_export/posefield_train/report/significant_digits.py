"""Numbers for JSON, rounded to six significant digits."""

from typing import Any

import numpy as np


def round_number(value: Any) -> float:
    """Return a number rounded to six significant digits."""
    return float(f"{float(value):.6g}")


def round_all(values: Any) -> Any:
    """Return nested dicts and sequences as JSON values, their floating-point numbers rounded."""
    if isinstance(values, dict):
        return {name: round_all(value) for name, value in values.items()}
    if isinstance(values, np.ndarray | np.generic):
        return round_all(values.tolist())
    if isinstance(values, list | tuple):
        return [round_all(value) for value in values]
    return round_number(values) if isinstance(values, float) else values
