"""Folds: examples that are held out together."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from posefield.common.errors import TrainingError
from posefield_train.kriging import sample_points
from posefield_train.source.ingest import Example

# Families of more than MANY takes are held out in PARTS parts of whole takes.
MANY, PARTS = 40, 12


@dataclass(frozen=True)
class Fold:
    """Examples that are held out together. held: their indices."""

    held: tuple[int, ...]

    def split(self, examples: Sequence[Example]) -> tuple[list[Example], list[Example]]:
        """Return the examples to train from, and those held out."""
        held = set(self.held)
        rest = [example for i, example in enumerate(examples) if i not in held]
        return rest, [examples[i] for i in self.held]


def clip_folds(examples: Sequence[Example]) -> list[Fold]:
    """Return folds that hold out every take once, with all of its clips.

    Strides of one take are nearly equal; held out one by one, they would predict each other. Raises
    TrainingError if all clips are of one take.
    """
    numbers = sample_points.take_numbers(examples)
    takes = [tuple(np.flatnonzero(numbers == take).tolist()) for take in np.unique(numbers)]
    if len(takes) == 1:
        raise TrainingError(
            f"all {len(examples)} clips are of one take, expected two or more takes: none can be "
            "held out (clips.take states takes)"
        )
    if len(takes) > MANY:
        takes = [sum(takes[part::PARTS], ()) for part in range(PARTS)]
    return [Fold(take) for take in takes]


def performer_folds(examples: Sequence[Example]) -> list[Fold]:
    """Return folds that hold out every performer once, with all of their clips."""
    return [Fold(own) for own in _groups([example.row.performer for example in examples])]


def _groups(names: Sequence[str]) -> list[tuple[int, ...]]:
    listed = np.array(names)
    return [tuple(np.flatnonzero(listed == name).tolist()) for name in sorted(set(names))]
