"""What clips are called where nobody said, and that no two are called the same."""

import hashlib
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Digests = NDArray[np.uint64]


def generated(index: int) -> str:
    """Name of the row of that index, counted from 0: whoever reads it, and whatever is skipped."""
    return f"clip-{index:06d}"


class Seen:
    """Names that were given so far, as 8 bytes each.

    Capitals count for nothing, as in some file systems. Of ten million names two have equal
    digests with a probability of 3 in a million, and are then taken for the same.
    """

    def __init__(self) -> None:
        # Sorted, each more than twice as long as the next, so that a name is merged a few times.
        self._runs: list[Digests] = []

    def repeated(self, names: Sequence[str]) -> list[int]:
        """Places of names that were seen before, here or earlier; all are seen from now on."""
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
    """A number of 64 bits for each name: the same in every process, unlike Python's hash."""
    made = (hashlib.blake2b(name.lower().encode(), digest_size=8).digest() for name in names)
    return np.frombuffer(b"".join(made), dtype="<u8").astype(np.uint64)
