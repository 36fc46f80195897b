"""Between rows of a table, and from one pose to another of nearly the same: what a switch of level
of detail goes through."""

from typing import Any

import numpy as np
import numpy.typing as npt

from service.motion.conventions import Floats

Numbers = npt.NDArray[Any]
"""Of any precision, which stays what it is."""


def between(rows: Floats, places: Floats) -> Floats:
    """Values (..., k) of rows (F, k) at places (...) among them, 0 to F - 1, linear between two."""
    before = np.minimum(places.astype(np.int64), len(rows) - 2)
    share = (places - before)[..., None]
    return (1.0 - share) * rows[before] + share * rows[before + 1]


def straight(before: Numbers, after: Numbers, shares: Numbers) -> Numbers:
    """Values (N, ...) so much (N,) of the way on a straight line."""
    way = shares.reshape(-1, *(1 for _ in before.shape[1:]))
    return before + way * (after - before)


def rotations(before: Numbers, after: Numbers, shares: Numbers) -> Numbers:
    """Unit quaternions (N, ..., 4) so much (N,) of the way, the shorter one.

    Along the chord, which for rotations a few degrees apart is the arc but for a share of 1e-4.
    """
    same = np.sum(before * after, axis=-1, keepdims=True) >= 0.0
    mixed = straight(before, np.where(same, after, -after), shares)
    turns: Numbers = mixed / np.linalg.norm(mixed, axis=-1, keepdims=True)
    return turns


def eased(shares: Numbers) -> Numbers:
    """Shares that set out and arrive gently, with no speed at either end."""
    gentle: Numbers = shares * shares * (3.0 - 2.0 * shares)
    return gentle
