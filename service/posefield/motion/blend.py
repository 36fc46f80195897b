"""Interpolation between rows of a table, and between poses at a switch of level of detail."""

from typing import Annotated, Any

import numpy as np
import numpy.typing as npt

from posefield.common.units import Floats

Numbers = npt.NDArray[Any]
"""Array of any precision; results have the precision of the arguments."""


def interpolate_rows(
    rows: Annotated[Floats, "frames values"], places: Annotated[Floats, "*places"]
) -> Annotated[Floats, "*places values"]:
    """Return rows (F, k) interpolated linearly at fractional indices (...) from 0 to F - 1.

    Shape of the result: (..., k).
    """
    before = np.minimum(places.astype(np.int64), len(rows) - 2)
    share = (places - before)[..., None]
    return (1.0 - share) * rows[before] + share * rows[before + 1]


def lerp(
    before: Annotated[Numbers, "rows *values"],
    after: Annotated[Numbers, "rows *values"],
    shares: Annotated[Numbers, "rows"],
) -> Annotated[Numbers, "rows *values"]:
    """Return linear interpolations (N, ...) from `before` to `after` by shares (N,), 0 to 1."""
    way = shares.reshape(-1, *(1 for _ in before.shape[1:]))
    return before + way * (after - before)


def nlerp(
    before: Annotated[Numbers, "rows *values 4"],
    after: Annotated[Numbers, "rows *values 4"],
    shares: Annotated[Numbers, "rows"],
) -> Annotated[Numbers, "rows *values 4"]:
    """Return unit quaternions (N, ..., 4) interpolated by shares (N,) along the shorter arc.

    Normalised linear interpolation: for rotations a few degrees apart it differs from slerp by a
    share of 1e-4.
    """
    same = np.sum(before * after, axis=-1, keepdims=True) >= 0.0
    mixed = lerp(before, np.where(same, after, -after), shares)
    turns: Numbers = mixed / np.linalg.norm(mixed, axis=-1, keepdims=True)
    return turns


def smoothstep(shares: Annotated[Numbers, "*batch"]) -> Annotated[Numbers, "*batch"]:
    """Return shares mapped by the smoothstep 3 s² - 2 s³, whose slope is zero at 0 and 1."""
    gentle: Numbers = shares * shares * (3.0 - 2.0 * shares)
    return gentle
