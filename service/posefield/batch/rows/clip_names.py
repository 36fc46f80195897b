"""Names of clips: generated names, and the detection of repeated ones."""

import hashlib
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Digests = NDArray[np.uint64]


def generated_name(index: int) -> str:
    """Return the name of the row with this index, from 0; it does not depend on skipped rows."""
    return f"clip-{index:06d}"


class UsedNames:
    """Set of the names used so far, as digests of 8 bytes each.

    Case is ignored, as in some file systems. Among ten million names, two have equal digests with a
    probability of 3 in a million; they are then reported as repeated.
    """

    def __init__(self) -> None:
        # Sorted arrays, each more than twice as long as the next, so that a name is merged few
        # times.
        self._runs: list[Digests] = []

    def find_repeated(self, names: Sequence[str]) -> list[int]:
        """Return the indices of names that occurred before, and add all names to the set."""
        digests = _digests(names)
        order = np.argsort(digests, kind="stable")
        ordered = digests[order]
        again = np.zeros(len(names), dtype=bool)
        again[order[1:]] = ordered[1:] == ordered[:-1]
        for run in self._runs:
            at = np.minimum(np.searchsorted(run, ordered), len(run) - 1)
            again[order] |= run[at] == ordered
        self._add(ordered[~again[order]])
        return [int(place) for place in np.flatnonzero(again)]

    def _add(self, run: Digests) -> None:
        while self._runs and len(self._runs[-1]) <= 2 * len(run):
            run = np.sort(np.concatenate([self._runs.pop(), run]), kind="stable")
        if len(run):
            self._runs.append(run)


def _digests(names: Sequence[str]) -> Digests:
    """Return a 64-bit digest of each name; unlike Python's hash, equal in every process."""
    made = (hashlib.blake2b(name.lower().encode(), digest_size=8).digest() for name in names)
    return np.frombuffer(b"".join(made), dtype="<u8").astype(np.uint64)
