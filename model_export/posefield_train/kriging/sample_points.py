"""Sample points: controls and labels of the examples."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Annotated

import numpy as np

from posefield.common.errors import TrainingError
from posefield.common.units import Floats, Indices, SampleControls, Samples, SampleValues
from posefield.kriging import kriging_model
from posefield.kriging.kriging_model import Hyper, LabelKernel
from posefield.kriging.support import half_ranges
from posefield_train.source.ingest import Example
from posefield_train.source.recipe import Recipe
from posefield_train.source.recipe_sections import PERFORMER

LARGEST_DENSE = 299
"""Clips up to which each clip has weights of its own (decision 0064)."""
INDUCING = 160
"""Inducing clips of a larger family, at most."""
LARGEST_TUNED = 500
"""Clips on which parameters are tuned, at most (decision 0025)."""
FEW_VALUES = 10
"""Values of a control up to which each of them has an inducing clip."""
# The means of the priors of scale and correlation, and of the offset.
SCALE, CORRELATION, OFFSET = 0.45, 0.5, 0.3
# Share of the variance below which a clip repeats others.
REPEATED = 1e-6


def choose_inducing(
    points: Samples, controls: int, labels: tuple[int, ...]
) -> Annotated[Indices, "inducing"] | None:
    """Return the sorted indices of inducing clips; None for a family of at most LARGEST_DENSE.

    points: (n, d + p), controls in half-ranges and weights of labels. controls: d. labels: number
    of names of each label set. The ends of each control's range, the values of a control of few,
    and each name have an inducing clip.
    """
    if len(points) <= LARGEST_DENSE:
        return None
    required: set[int] = set()
    for column in points[:, :controls].T:
        values, first = np.unique(column, return_index=True)
        extremes = {int(first[0]), int(first[-1])}
        required |= {*first.tolist()} if len(values) <= FEW_VALUES else extremes
    needed = sorted(required | {int(np.argmax(column)) for column in points[:, controls:].T})
    count = max(INDUCING, len(needed))
    return np.sort(_pivoted(points, fixed_parameters(controls, labels), count, needed))


def choose_tuned(
    points: Samples, controls: int, labels: tuple[int, ...], draw: int
) -> Annotated[Indices, "tuned"]:
    """Return the sorted indices of the clips of one draw, of LARGEST_TUNED at most.

    Half of them lie apart; the others are random, because near pairs tell the nugget. draw: 0 or 1;
    the two share no clip where not all are drawn, so that a draw is of half the clips at most.
    Other arguments as in `choose_inducing`.
    """
    if len(points) <= LARGEST_TUNED:
        return np.arange(len(points))
    mixed = np.random.Generator(np.random.PCG64(len(points))).permutation(len(points))
    half = mixed[draw::2]
    hyper = fixed_parameters(controls, labels)
    spread = half[_pivoted(points[half], hyper, LARGEST_TUNED // 2, ())]
    rest = half[~np.isin(half, spread)]
    return np.sort(np.concatenate([spread, rest[: LARGEST_TUNED - len(spread)]]))


def tuned_count(clips: int) -> int:
    """Return the number of clips of a family's first draw, on which parameters are tuned."""
    return clips if clips <= LARGEST_TUNED else min(LARGEST_TUNED, (clips + 1) // 2)


def fixed_parameters(controls: int, labels: tuple[int, ...]) -> Hyper:
    """Return the parameters of the covariance that clips are chosen by."""
    kernels = tuple(LabelKernel(count, CORRELATION, OFFSET) for count in labels)
    return Hyper("matern52", (0,), np.full(controls, SCALE), 0.0, 0.0, kernels)


def _pivoted(
    points: Samples, hyper: Hyper, count: int, first: Sequence[int]
) -> Annotated[Indices, "chosen"]:
    """Return `count` samples, fewer where the rest repeats them: `first`, then the pivots."""
    unknown = kriging_model.prior_variances(hyper, points)
    largest = float(unknown.max())
    columns: Annotated[Floats, "chosen samples"] = np.zeros((count, len(points)))
    pivots: list[int] = []
    while len(pivots) < min(count, len(points)):
        at = len(pivots)
        # Rounded, so that rounding errors do not break ties.
        chosen = first[at] if at < len(first) else int(np.argmax(np.round(unknown, 9)))
        if at >= len(first) and unknown[chosen] < REPEATED * largest:
            break
        pivots.append(chosen)
        left = kriging_model.covariances(hyper, points[[chosen]], points)[0]
        left = left - columns[:at, chosen] @ columns[:at]
        if unknown[chosen] >= REPEATED * largest:
            columns[at] = left / np.sqrt(unknown[chosen])
        unknown = unknown - np.square(columns[at])
        unknown[pivots] = 0.0
    return np.array(pivots)


LabelNames = Mapping[str, tuple[str, ...]]
"""Names of each label set, in the order of their columns."""


@dataclass(frozen=True)
class SamplePoints:
    """Sample points of a kriging model.

    points: (n, d + p), controls in half-ranges, then the weights of labels. controls: d. groups:
    group (n,) of each sample; a group is left out together. labels: number of names of each label
    set, p together. unnamed: there are several performers, and their names are not among the
    labels. inducing: indices of the clips whose covariances a large family is predicted by; None
    where each clip's are.
    """

    points: Samples
    controls: int
    groups: Annotated[Indices, "samples"]
    labels: tuple[int, ...] = ()
    unnamed: bool = False
    inducing: Annotated[Indices, "inducing"] | None = None

    def __post_init__(self) -> None:
        if self.points.shape[1] != self.controls + sum(self.labels):
            expected = f"{self.controls} controls and {self.labels} labels"
            raise ValueError(f"points {self.points.shape}, expected {expected}")

    @property
    def half_ranges(self) -> SampleControls:
        """Return the controls (n, d) in half-ranges, without labels."""
        return self.points[:, : self.controls]

    @property
    def label_indices(self) -> list[Annotated[Indices, "samples"]]:
        """Return the index (n,) of each sample's name in each label set."""
        columns = kriging_model.label_columns(self.controls, self.labels)
        return [np.argmax(self.points[:, columns_of_set], axis=1) for columns_of_set in columns]

    def subset(self, rows: Annotated[Indices, "rows"]) -> "SamplePoints":
        """Return some of the samples, none of them inducing."""
        return replace(self, points=self.points[rows], groups=self.groups[rows], inducing=None)

    def from_mean(self, values: SampleValues) -> SampleValues:
        """Return the differences of values (n, m) from the mean of all other groups."""
        _, inverse, counts = np.unique(self.groups, return_inverse=True, return_counts=True)
        sums = np.zeros((len(counts), values.shape[1]))
        for group, row in zip(inverse, values, strict=True):
            sums[group] += row
        other_means = (values.sum(axis=0) - sums[inverse]) / (len(values) - counts[inverse])[
            :, None
        ]
        return values - other_means


def label_weights(
    labels: Sequence[Mapping[str, str]], label_names: LabelNames
) -> Annotated[Floats, "{len(labels)} _"]:
    """Return weights (N, p) of the labels of N clips: one for a clip's name in each label set.

    Those of a set are zero for an unknown name, and for a set that a clip does not name.
    """
    rows = [
        [
            float(one.get(label_set) == name)
            for label_set, names in label_names.items()
            for name in names
        ]
        for one in labels
    ]
    return np.array(rows).reshape(len(labels), sum(map(len, label_names.values())))


def make_samples(recipe: Recipe, examples: Sequence[Example]) -> tuple[SamplePoints, LabelNames]:
    """Return the samples of a recipe's examples, and the sorted names of each label set.

    A label set of which all examples have one name is left out. Raises TrainingError if a drift
    depends on a single example.
    """
    points = _points(examples)
    row_labels = [example.row.labels for example in examples]
    names_by_set = {
        label_set: tuple(sorted({labels[label_set] for labels in row_labels}))
        for label_set in recipe.kriging.label
    }
    label_names = {label_set: names for label_set, names in names_by_set.items() if len(names) > 1}
    both = np.hstack([points, label_weights(row_labels, label_names)])
    counts = tuple(map(len, label_names.values()))
    groups = _groups(recipe, examples, points)
    several = len({example.row.performer for example in examples}) > 1
    unnamed = several and PERFORMER not in label_names
    # Without a nugget a model passes through every clip.
    exact = recipe.kriging.nugget == 0
    d = points.shape[1]
    inducing = None if exact else choose_inducing(both, d, counts)
    return SamplePoints(both, d, groups, counts, unnamed, inducing), label_names


def data_notes(recipe: Recipe, examples: Sequence[Example]) -> list[str]:
    """Return one note per setting of the recipe that the examples are too few for."""
    samples, label_names = make_samples(recipe, examples)
    notes = [
        f"all clips are of one {label_set}, {examples[0].row.labels[label_set]!r}: kriging.label "
        "has no effect"
        for label_set in recipe.kriging.label
        if label_set not in label_names
    ]
    notes += _repeated_sets(samples, tuple(label_names))
    if len(np.unique(samples.groups)) > len(np.unique(recording_numbers(examples))):
        notes.append(
            "clips of one recording are not left out together: those of the other recordings "
            "alone could not carry the drift"
        )
    return notes


def _repeated_sets(samples: SamplePoints, names: Sequence[str]) -> list[str]:
    """Return a note for each two label sets that divide the samples alike."""
    indices = dict(zip(names, samples.label_indices, strict=True))
    return [
        f"label sets {one!r} and {other!r} divide the clips alike: nothing tells their effects "
        "apart, expected clips of one name in several of the other"
        for one, other in combinations(names, 2)
        if len(set(zip(indices[one].tolist(), indices[other].tolist(), strict=True)))
        == len(set(indices[one].tolist()))
        == len(set(indices[other].tolist()))
    ]


def _points(examples: Sequence[Example]) -> SampleControls:
    controls = np.stack([example.controls for example in examples])
    return half_ranges(controls, controls.min(axis=0), controls.max(axis=0))


def recording_numbers(examples: Sequence[Example]) -> Annotated[Indices, "{len(examples)}"]:
    """Return the number (N,) of each example's recording; of its file without one."""
    recordings = [example.recording or str(example.row.file) for example in examples]
    return np.unique(recordings, return_inverse=True)[1]


def _groups(
    recipe: Recipe, examples: Sequence[Example], points: SampleControls
) -> Annotated[Indices, "samples"]:
    """Return groups (N,) by recording, or singletons if the drift is undetermined without one.

    Raises TrainingError if the drift is undetermined without a single example.
    """
    degree = recipe.kriging.degree
    by_recording, alone = recording_numbers(examples), np.arange(len(examples))
    if _indispensable_group(by_recording, points, degree) is None:
        return by_recording
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
