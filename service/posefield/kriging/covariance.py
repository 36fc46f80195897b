"""Covariance models of unit sill and unit range, as functions of squared distance.

Ranges are practical: at distance one 95 % of the sill is reached (all of it for the spherical one).
The training job has the same formulas as graph operations.
"""

from collections.abc import Callable
from typing import Annotated

import numpy as np

from posefield.common.units import Floats

# Where the Matérn covariances of unit rate have fallen to 5 %.
RATE32, RATE52 = 4.743865, 5.918277


def exponential(squared: Annotated[Floats, "*batch"]) -> Annotated[Floats, "*batch"]:
    """Return exp(-3 h)."""
    return np.exp(-3.0 * np.sqrt(squared))


def gaussian(squared: Annotated[Floats, "*batch"]) -> Annotated[Floats, "*batch"]:
    """Return exp(-3 h²)."""
    return np.exp(-3.0 * squared)


def spherical(squared: Annotated[Floats, "*batch"]) -> Annotated[Floats, "*batch"]:
    """Return 1 - 3/2 h + 1/2 h³ up to h = 1, and zero beyond."""
    h = np.minimum(np.sqrt(squared), 1.0)
    return 1.0 - 1.5 * h + 0.5 * h**3


def matern32(squared: Annotated[Floats, "*batch"]) -> Annotated[Floats, "*batch"]:
    """Return the Matérn covariance of smoothness 3/2."""
    a = RATE32 * np.sqrt(squared)
    return (1.0 + a) * np.exp(-a)


def matern52(squared: Annotated[Floats, "*batch"]) -> Annotated[Floats, "*batch"]:
    """Return the Matérn covariance of smoothness 5/2."""
    a = RATE52 * np.sqrt(squared)
    return (1.0 + a + RATE52**2 / 3.0 * squared) * np.exp(-a)


COVARIANCE_MODELS: dict[str, Callable[[Floats], Floats]] = {
    formula.__name__: formula for formula in (exponential, gaussian, spherical, matern32, matern52)
}
"""Covariance models by the names that recipes and cards use."""

KERNEL_GAINS = {
    "exponential": 9.0,
    "gaussian": 3.0,
    "spherical": 1.0,
    "matern32": RATE32**2,
    "matern52": RATE52**2,
}
"""Factors of squared distances with which a kernel on a graphics card computes fewer products."""
