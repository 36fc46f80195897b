"""Where samples lie: controls, and who moved."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from model_export.field_bank import half_ranges
from model_export.ingest import Example
from model_export.recipe import Recipe
from service.motion.conventions import Floats, Indices


@dataclass(frozen=True)
class Samples:
    """Where a field's samples lie.

    points (n, d + p): controls in half-ranges, then the performers' labels. controls: d. groups
    (n,): samples that are left out together.
    """

    points: Floats
    controls: int
    groups: Indices

    @property
    def labelled(self) -> bool:
        """Whether performers are told apart."""
        return self.points.shape[1] > self.controls

    def from_mean(self, values: Floats) -> Floats:
        """How far each of values (n, m) lies from the mean of all other groups."""
        _, inverse, counts = np.unique(self.groups, return_inverse=True, return_counts=True)
        sums = np.zeros((len(counts), values.shape[1]))
        np.add.at(sums, inverse, values)
        others = (values.sum(axis=0) - sums[inverse]) / (len(values) - counts[inverse])[:, None]
        return values - others


def labels(names: Sequence[str], performers: Sequence[str]) -> Floats:
    """Labels (N, p) of who moved: one for the performer's own, zeros where the name is unknown."""
    own = [[float(name == performer) for performer in performers] for name in names]
    return np.array(own).reshape(len(names), len(performers))


def lay(recipe: Recipe, examples: Sequence[Example]) -> tuple[Samples, tuple[str, ...]]:
    """Samples of a recipe's examples, and the performers that it tells apart, by name."""
    controls = np.stack([example.controls for example in examples])
    names = [example.row.performer for example in examples]
    performers = tuple(sorted(set(names))) if recipe.kriging.label else ()
    points = half_ranges(controls, controls.min(axis=0), controls.max(axis=0))
    _, takes = np.unique([str(e.row.place) for e in examples], return_inverse=True)
    both = np.hstack([points, labels(names, performers)])
    return Samples(both, controls.shape[1], takes), performers
