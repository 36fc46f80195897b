"""Which examples are held out together."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from model_export.ingest import Example

# Families of more takes than this are held out in as many parts, each of whole takes.
MANY, PARTS = 40, 12


@dataclass(frozen=True)
class Fold:
    """Indices of the examples that are held out; all others are trained from."""

    held: tuple[int, ...]

    def split(self, examples: Sequence[Example]) -> tuple[list[Example], list[Example]]:
        """Examples to train from, and those held out."""
        held = set(self.held)
        rest = [example for i, example in enumerate(examples) if i not in held]
        return rest, [examples[i] for i in self.held]


def clips(examples: Sequence[Example]) -> list[Fold]:
    """Every take held out once, with all clips that were cut from it.

    Strides of one take are nearly equal: held out one by one they would give each other away.
    """
    takes = _groups([str(example.row.place) for example in examples])
    if len(takes) > MANY:
        takes = [sum(takes[part::PARTS], ()) for part in range(PARTS)]
    return [Fold(take) for take in takes]


def performers(examples: Sequence[Example]) -> list[Fold]:
    """Every performer held out once, with everything that they did."""
    return [Fold(own) for own in _groups([example.row.performer for example in examples])]


def _groups(names: Sequence[str]) -> list[tuple[int, ...]]:
    listed = np.array(names)
    return [tuple(np.flatnonzero(listed == name).tolist()) for name in sorted(set(names))]
