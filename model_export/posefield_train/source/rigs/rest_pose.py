"""Checks of the rest pose and of the bones of performers."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from posefield.common.units import Floats

SMALLEST = 1e-6
"""Total length of bones below which all joints lie in one point, m."""
OTHER_BODY = 0.05
"""Root mean square difference of two bodies' bones, as a share of the bones' own."""


def is_degenerate(offsets: Floats) -> bool:
    """Return whether a skeleton of several joints with bone offsets (J, 3), m, is a point."""
    return len(offsets) > 1 and float(np.linalg.norm(offsets[1:], axis=-1).sum()) < SMALLEST


@dataclass(frozen=True)
class TwoBodies:
    """Clips of one performer with two different bodies.

    first, second: indices of a clip of each. counts: number of clips of each. apart: root mean
    square difference of their bone offsets, m.
    """

    performer: str
    first: int
    second: int
    counts: tuple[int, int]
    apart: float

    def sentence(self, names: Sequence[str]) -> str:
        """Return the finding in words, for an error. names: of the clips' files."""
        several, few = self.counts
        return (
            f"two performers under the name {self.performer!r}: the bones of {few} clips, such as "
            f"{names[self.second]}, differ by {100 * self.apart:.1f} cm from those of {several}, "
            f"such as {names[self.first]}; expected one body for each name"
        )


def find_two_bodies(offsets: Floats, performers: Sequence[str]) -> TwoBodies | None:
    """Return the first performer with two bodies; None if each has one.

    offsets: of the bones (N, J, 3), m. performers: names (N,), "" for none. A single clip that
    differs from the others is no second body: the detection of outliers tells of it.
    """
    for performer in sorted(set(performers) - {""}):
        own = np.flatnonzero(np.array(performers) == performer)
        found = _split(offsets[own])
        if found:
            first, second, counts, apart = found
            return TwoBodies(performer, int(own[first]), int(own[second]), counts, apart)
    return None


def _split(offsets: Floats) -> tuple[int, int, tuple[int, int], float] | None:
    """Return a clip of each body, the clips of each, and their difference, m; None for one body.

    The clips that are like one of them are compared with those that are not.
    """
    usual = float(np.sqrt(np.mean(np.sum(np.square(offsets), axis=-1))))
    apart = np.stack([_distances(offsets, one) for one in offsets])
    alike = apart <= OTHER_BODY * usual
    first = int(np.argmax(alike.sum(axis=1)))
    others = np.flatnonzero(~alike[first])
    if len(others) < 2:
        return None
    second = int(others[np.argmax(alike[others].sum(axis=1))])
    count = int(alike[second].sum())
    if count < 2:
        return None
    return first, second, (int(alike[first].sum()), count), float(apart[first, second])


def _distances(offsets: Floats, one: Floats) -> Floats:
    """Return the root mean square distances (N,), m, of offsets (N, J, 3) from one's (J, 3)."""
    return np.asarray(np.sqrt(np.mean(np.sum(np.square(offsets - one), axis=-1), axis=-1)))
