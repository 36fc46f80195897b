"""Sample points: controls and performers of the examples."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import SampleControls, Samples, SampleValues
from posefield.common.errors import TrainingError
from posefield.common.units import Floats, Indices
from posefield.kriging import kriging_model
from posefield.kriging.kriging_model import half_ranges
from posefield_train.source.ingest import Example
from posefield_train.source.recipe import Recipe

NO_SAMPLES = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True)
class SamplePoints:
    """Sample points of a kriging model.

    points: (n, d + p), controls in half-ranges, then the performers' labels. controls: d. groups:
    group (n,) of each sample; a group is left out together.
    """

    points: Samples
    controls: int
    groups: Annotated[Indices, "samples"]

    @property
    def half_ranges(self) -> SampleControls:
        """Return the controls (n, d) in half-ranges, without labels."""
        return self.points[:, : self.controls]

    @property
    def labelled(self) -> bool:
        """Return True if performers have labels."""
        return self.points.shape[1] > self.controls

    @property
    def moved_by(self) -> Annotated[Indices, "samples"]:
        """Return the index (n,) of each sample's performer; empty without labels."""
        return np.argmax(self.points[:, self.controls :], axis=1) if self.labelled else NO_SAMPLES

    def from_mean(self, values: SampleValues) -> SampleValues:
        """Return the differences of values (n, m) from the mean of all other groups."""
        _, inverse, counts = np.unique(self.groups, return_inverse=True, return_counts=True)
        sums = np.zeros((len(counts), values.shape[1]))
        for group, own in zip(inverse, values, strict=True):
            sums[group] += own
        others = (values.sum(axis=0) - sums[inverse]) / (len(values) - counts[inverse])[:, None]
        return values - others


def performer_labels(
    names: Sequence[str], performers: Sequence[str]
) -> Annotated[Floats, "{len(names)} {len(performers)}"]:
    """Return one-hot labels (N, p) of performers, zeros for an unknown name."""
    own = [[float(name == performer) for performer in performers] for name in names]
    return np.array(own).reshape(len(names), len(performers))


def make_samples(
    recipe: Recipe, examples: Sequence[Example]
) -> tuple[SamplePoints, tuple[str, ...]]:
    """Return the samples of a recipe's examples, and the labelled performers sorted by name.

    Raises TrainingError if a drift depends on a single example.
    """
    points = _points(examples)
    names = [example.row.performer for example in examples]
    # A single performer needs no label.
    apart = recipe.kriging.label is not None and len(set(names)) > 1
    performers = tuple(sorted(set(names))) if apart else ()
    both = np.hstack([points, performer_labels(names, performers)])
    return SamplePoints(both, points.shape[1], _groups(recipe, examples, points)), performers


def data_notes(recipe: Recipe, examples: Sequence[Example]) -> list[str]:
    """Return one note per setting of the recipe that the examples are too few for."""
    said = []
    laid, performers = make_samples(recipe, examples)
    if recipe.kriging.label and not performers:
        name = examples[0].row.performer
        said.append(f"all clips are of one performer, {name!r}: kriging.label has no effect")
    if len(np.unique(laid.groups)) > len(np.unique(take_numbers(examples))):
        said.append(
            "clips of one file are not left out together: those of the other files alone could "
            "not carry the drift"
        )
    return said


def _points(examples: Sequence[Example]) -> SampleControls:
    controls = np.stack([example.controls for example in examples])
    return half_ranges(controls, controls.min(axis=0), controls.max(axis=0))


def take_numbers(examples: Sequence[Example]) -> Annotated[Indices, "{len(examples)}"]:
    """Return the number (N,) of the file that each example was cut from."""
    return np.unique([str(e.row.place) for e in examples], return_inverse=True)[1]


def _groups(
    recipe: Recipe, examples: Sequence[Example], points: SampleControls
) -> Annotated[Indices, "samples"]:
    """Return groups (N,) by file, or singletons if the drift is undetermined without a file.

    Raises TrainingError if the drift is undetermined without a single example.
    """
    degree = recipe.kriging.degree
    by_file, alone = take_numbers(examples), np.arange(len(examples))
    if _indispensable_group(by_file, points, degree) is None:
        return by_file
    needed = _indispensable_group(alone, points, degree)
    if needed is not None:
        raise TrainingError(
            f"without the clip of line {examples[needed].row.line} the controls of all others "
            "follow linearly from one another, and it can only be predicted by a drift of degree "
            "0; expected at least two clips that differ there: add one, or set kriging.drift to 0"
        )
    return alone


def _indispensable_group(
    groups: Annotated[Indices, "samples"], points: SampleControls, degree: int
) -> int | None:
    """Return the first group without which points (N, d) do not determine the drift, or None."""
    return kriging_model.find_required_group(
        groups, kriging_model.drift(points, points.shape[1], degree)
    )
