"""Kriging of one quantity: covariances, drift functions and weights of the samples.

The system is [[C + nugget I, F], [Fᵀ, 0]] with covariance C between samples and drift F. Its
inverse gives the weight of each sample at a point. Training stores products of these weights in the
model file; the service computes the weights to explain a result.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Annotated, Any

import numpy as np

from posefield.common.bounded_types import Count, Degree, NonNegative
from posefield.common.units import (
    Floats,
    Indices,
    PerControl,
    PerPoint,
    PerSample,
    Points,
    PointSamples,
    SampleMatrix,
    Samples,
)

Array = Any
"""Array of NumPy, torch or JAX."""
# Where the Matérn covariances of unit rate have fallen to 5 %.
RATE32, RATE52 = 4.743865, 5.918277


def exponential(squared: Array, xp: Any = np) -> Array:
    """Return exp(-3 h)."""
    return xp.exp(-3.0 * xp.sqrt(squared))


def gaussian(squared: Array, xp: Any = np) -> Array:
    """Return exp(-3 h²)."""
    return xp.exp(-3.0 * squared)


def spherical(squared: Array, xp: Any = np) -> Array:
    """Return 1 - 3/2 h + 1/2 h³ up to h = 1, and zero beyond."""
    h = xp.clip(xp.sqrt(squared), None, 1.0)
    return 1.0 - 1.5 * h + 0.5 * h**3


def matern32(squared: Array, xp: Any = np) -> Array:
    """Return the Matérn covariance of smoothness 3/2."""
    a = RATE32 * xp.sqrt(squared)
    return (1.0 + a) * xp.exp(-a)


def matern52(squared: Array, xp: Any = np) -> Array:
    """Return the Matérn covariance of smoothness 5/2."""
    a = RATE52 * xp.sqrt(squared)
    return (1.0 + a + RATE52**2 / 3.0 * squared) * xp.exp(-a)


COVARIANCE_MODELS: dict[str, Callable[..., Array]] = {
    formula.__name__: formula for formula in (exponential, gaussian, spherical, matern32, matern52)
}
"""Covariance models of squared distances by the names that recipes and cards use.

They take the module of the arrays, which is NumPy unless it is given: training loops use others.
"""

KERNEL_GAINS = {
    "exponential": 9.0,
    "gaussian": 3.0,
    "spherical": 1.0,
    "matern32": RATE32**2,
    "matern52": RATE52**2,
}
"""Factors of squared distances with which a kernel on a graphics card computes fewer products."""


@dataclass(frozen=True)
class LabelKernel:
    """Part of a covariance that depends on one label set, such as performers or styles.

    count: number of names in the set. correlation: of the motions of two names, at equal controls
    and other labels. offset: variance of a name's own offset, in sills.
    """

    count: Count
    correlation: NonNegative
    offset: NonNegative


@dataclass(frozen=True)
class Hyper:
    """Parameters of a kriged field.

    The covariance of two points is f(h) Π (c + (1 - c) s) + Σ a s + trend x·x', with the covariance
    model f at their scaled distance h, and their controls x and x' in half-ranges. Product and sum
    are over the label sets, with correlation c, offset a, and the inner product s of the points'
    weights of the set's names: 1 for one name, 0 for different ones. Each s is a Gram matrix of
    weights, so that sums, products and multiples of them by positive numbers are positive
    semidefinite (decision 0054).

    covariance: name in `COVARIANCE_MODELS`. drifts: polynomial degrees, 0 or 1, whose predictions
    are averaged; labels never enter it. scales (d,): distance per unit of each control, one over
    the range. nugget: share of the sill. trend: variance of the slope along each control, in sills
    per squared half-range. labels: a kernel for each label set.
    """

    covariance: str
    drifts: tuple[Degree, ...]
    scales: PerControl
    nugget: NonNegative
    trend: NonNegative
    labels: tuple[LabelKernel, ...] = ()

    @property
    def label_counts(self) -> tuple[int, ...]:
        """Return the number of names of each label set."""
        return tuple(label.count for label in self.labels)

    def with_offsets(self, *offsets: float) -> "Hyper":
        """Return the parameters with the offset of each label set replaced."""
        pairs = zip(self.labels, offsets, strict=True)
        return replace(self, labels=tuple(replace(label, offset=a) for label, a in pairs))

    def without_offsets(self) -> "Hyper":
        """Return the parameters with offsets of zero."""
        return self.with_offsets(*(0.0 for _ in self.labels))


@dataclass(frozen=True)
class KrigingWeights:
    """Kriging weights of samples (n, d + p): d controls in half-ranges and p weights of labels.

    The weight of a sample's name is one in each label set and that of the others zero. All of a set
    are zero for an unseen name, and a mixture has several above zero.
    """

    hyper: Hyper
    samples: Samples

    @cached_property
    def weight_matrix(self) -> Annotated[Floats, "system samples"]:
        """Return the matrix (n + k, n) from covariances and drift functions to sample weights."""
        return weight_matrix(self.hyper, self.samples)

    def weights(
        self, points: Annotated[Floats, "*some points coordinates"]
    ) -> Annotated[Floats, "*some points samples"]:
        """Return the weights (..., B, n) of the samples at points (..., B, d + p).

        They sum to one and may be negative.
        """
        return basis_functions(self.hyper, points, self.samples) @ self.weight_matrix

    def distances(self, points: Points) -> PointSamples:
        """Return the distances (B, n) to the samples.

        At distance one at most 5 % of the covariance is left.
        """
        return np.sqrt(squared_distances(self.hyper, points, self.samples))


def squared_distances(
    hyper: Hyper, a: Annotated[Floats, "a coordinates"], b: Annotated[Floats, "b coordinates"]
) -> Annotated[Floats, "a b"]:
    """Return the squared distances (A, B) between the controls of points (A, d + p), (B, d + p)."""
    d = len(hyper.scales)
    # One plane (A, B) per control: a sum over a short last axis takes ten times as long.
    gaps = np.subtract(a.T[:d, :, None], b.T[:d, None, :], order="C")
    gaps *= hyper.scales[:, None, None]
    return np.asarray(np.sum(np.square(gaps, out=gaps), axis=0))


def stationary_covariances(
    hyper: Hyper, a: Annotated[Floats, "*some a coordinates"], b: Annotated[Floats, "b coordinates"]
) -> Annotated[Floats, "*some a b"]:
    """Return the part (..., A, B) of the covariances that depends on the points' distance."""
    squares = squared_distances(hyper, a.reshape(-1, a.shape[-1]), b)
    covariances = COVARIANCE_MODELS[hyper.covariance](squares).reshape(*a.shape[:-1], len(b))
    for label, same in zip(hyper.labels, label_products(hyper, a, b), strict=True):
        covariances = covariances * (label.correlation + (1.0 - label.correlation) * same)
    return covariances


def label_products(
    hyper: Hyper, a: Annotated[Floats, "*some a coordinates"], b: Annotated[Floats, "b coordinates"]
) -> list[Annotated[Floats, "*some a b"]]:
    """Return the inner products (..., A, B) of the points' weights of each label set's names."""
    columns = label_columns(len(hyper.scales), hyper.label_counts)
    return [a[..., columns_of_label] @ b[:, columns_of_label].T for columns_of_label in columns]


def label_columns(first: int, counts: Sequence[int]) -> list[slice]:
    """Return the columns of each label set, of that many names, from the first column on."""
    bounds = np.cumsum([first, *counts]).tolist()
    return [slice(start, end) for start, end in pairwise(bounds)]


def covariances(
    hyper: Hyper, a: Annotated[Floats, "*some a coordinates"], b: Annotated[Floats, "b coordinates"]
) -> Annotated[Floats, "*some a b"]:
    """Return the covariances (..., A, B) between points (..., A, d + p) and (B, d + p)."""
    matrix, d = stationary_covariances(hyper, a, b), len(hyper.scales)
    for label, same in zip(hyper.labels, label_products(hyper, a, b), strict=True):
        matrix = matrix + label.offset * same
    if hyper.trend:
        matrix = matrix + hyper.trend * (a[..., :d] @ b[:, :d].T)
    return matrix


def prior_variances(hyper: Hyper, points: Points) -> PerPoint:
    """Return the variance (B,) of the field at points (B, d + p) before any sample, in sills.

    A name without samples has an offset as unknown as any. What a mixture's weights leave of unit
    length counts as such a name.
    """
    controls = points[:, : len(hyper.scales)]
    squares = np.sum(np.square(controls), axis=1)
    return 1.0 + sum(label.offset for label in hyper.labels) + hyper.trend * squares


def drift(
    points: Annotated[Floats, "*some points coordinates"], controls: int, degree: int
) -> Annotated[Floats, "*some points functions"]:
    """Return the drift functions (..., B, k) at points (..., B, d + p).

    A constant, and for degree one also the controls.
    """
    one = np.ones((*points.shape[:-1], 1))
    return np.concatenate([one, points[..., :controls]], axis=-1) if degree else one


def linear_functions(hyper: Hyper, points: Points) -> Annotated[Floats, "points linear"]:
    """Return weights of labels, one and controls (B, p + 1 + d) of points (B, d + p).

    In them and the stationary covariances every kriging prediction is linear.
    """
    d = len(hyper.scales)
    return np.hstack([points[:, d:], np.ones((len(points), 1)), points[:, :d]])


def linear_terms(hyper: Hyper, samples: Samples) -> Annotated[Floats, "linear system"]:
    """Return the map (p + 1 + d, n + k) from `linear_functions` to `basis_functions`.

    With the stationary covariances added to its first n columns, it gives the whole of these.
    """
    (n, width), d, degree = samples.shape, len(hyper.scales), max(hyper.drifts)
    p = width - d
    terms = np.zeros((p + 1 + d, n + 1 + degree * d))
    for label, columns in zip(hyper.labels, label_columns(0, hyper.label_counts), strict=True):
        terms[columns, :n] = label.offset * samples.T[d:][columns]
    terms[p + 1 :, :n] = hyper.trend * samples[:, :d].T
    terms[p, n] = 1.0
    terms[p + 1 :, n + 1 :] = np.eye(d) if degree else terms[p + 1 :, n + 1 :]
    return terms


def find_required_group(
    groups: Annotated[Indices, "samples"], functions: Annotated[Floats, "samples functions"]
) -> int | None:
    """Return the first group of samples that cannot be left out; None if there is none.

    A group is needed if the drift functions (n, k) of the other samples do not determine a drift.
    groups: (n,).
    """
    for group in np.unique(groups):
        if np.linalg.matrix_rank(functions[groups != group]) < functions.shape[1]:
            return int(group)
    return None


def basis_functions(
    hyper: Hyper, points: Annotated[Floats, "*some points coordinates"], samples: Samples
) -> Annotated[Floats, "*some points system"]:
    """Return covariances with all samples and drift functions (..., B, n + k) at points."""
    near = covariances(hyper, points, samples)
    return np.concatenate([near, drift(points, len(hyper.scales), max(hyper.drifts))], axis=-1)


def noisy(hyper: Hyper, samples: Samples) -> SampleMatrix:
    """Return the covariance (n, n) of measured samples: the field's, plus the nugget."""
    return covariances(hyper, samples, samples) + hyper.nugget * np.eye(len(samples))


def invert_system(
    hyper: Hyper, samples: Samples, degree: int
) -> Annotated[Floats, "system system"]:
    """Return the inverse (n + k, n + k) of the kriging system with a drift of one degree."""
    f = drift(samples, len(hyper.scales), degree)
    n, k = f.shape
    system = np.zeros((n + k, n + k))
    system[:n, :n] = noisy(hyper, samples)
    system[:n, n:], system[n:, :n] = f, f.T
    return np.linalg.inv(system)


def weight_matrix(hyper: Hyper, samples: Samples) -> Annotated[Floats, "system samples"]:
    """Return the matrix (n + k, n) from covariances and drift functions to sample weights.

    With more than one drift the weights are averaged.
    """
    n, functions = len(samples), 1 + max(hyper.drifts) * len(hyper.scales)
    matrix = np.zeros((n + functions, n))
    for degree in hyper.drifts:
        inverse = invert_system(hyper, samples, degree)[:, :n]
        matrix[: len(inverse)] += inverse / len(hyper.drifts)
    return matrix


def residual_matrix(
    inverse: SampleMatrix,
    functions: Annotated[Floats, "samples functions"],
    groups: Annotated[Indices, "samples"],
) -> SampleMatrix:
    """Return the matrix (n, n) from values to residuals for one drift.

    A residual is a sample's value minus its prediction from all other groups. inverse (n, n): of
    the covariances of measured samples. functions (n, k): the drift's. groups (n,): samples of one
    group, such as strides cut from one take, are left out together.
    """
    block = sample_block(inverse, functions)
    return divide_groups(block, block, equal_sized_groups(groups))


def sample_block(
    inverse: SampleMatrix, functions: Annotated[Floats, "samples functions"]
) -> SampleMatrix:
    """Return the sample block (n, n) of the inverse of the whole system [[C, F], [Fᵀ, 0]].

    inverse (n, n): of the covariances C. functions (n, k): the drift's, F.
    """
    weighed = inverse @ functions
    block: Floats = inverse - weighed @ np.linalg.solve(functions.T @ weighed, weighed.T)
    return block


def divide_groups(
    block: SampleMatrix,
    rows: Annotated[Floats, "samples _"],
    several: list[Annotated[Indices, "_ _"]],
) -> Annotated[Floats, "samples _"]:
    """Return rows (n, m), each group's multiplied by the inverse of its part of a block (n, n).

    several: of the groups of more than one sample, as `equal_sized_groups` returns them.
    """
    divided: Floats = rows / np.diagonal(block)[:, None]
    for group in several:
        among = block[group[:, :, None], group[:, None, :]]
        divided[group] = np.linalg.solve(among, rows[group])
    return divided


def equal_sized_groups(
    groups: Annotated[Indices, "samples"],
) -> list[Annotated[Indices, "_ _"]]:
    """Return sample indices (g, size) of the groups (n,) of each size above one."""
    _, names, sizes = np.unique(groups, return_inverse=True, return_counts=True)
    order = np.argsort(names, kind="stable")
    several = np.unique(sizes[sizes > 1])
    return [order[sizes[names[order]] == size].reshape(-1, size) for size in several]


def leave_out(
    hyper: Hyper, samples: Samples, groups: Annotated[Indices, "samples"]
) -> SampleMatrix:
    """Return the matrix (n, n) from values to leave-one-out residuals of one field.

    samples (n, d + p): d controls in half-ranges and p weights of labels. With more than one drift,
    a residual is from the mean of the predictions.
    """
    d = len(hyper.scales)
    inverse: Floats = np.asarray(np.linalg.inv(noisy(hyper, samples)))
    matrices = [
        residual_matrix(inverse, drift(samples, d, degree), groups) for degree in hyper.drifts
    ]
    return np.asarray(sum(matrices[1:], matrices[0]) / len(matrices))


def left_out_variances(hyper: Hyper, samples: Samples, left_out: SampleMatrix) -> PerSample:
    """Return the variances (n,) of residuals by a matrix (n, n) of `leave_out`.

    They include the nugget and are shares of the sill.
    """
    return np.sum((left_out @ noisy(hyper, samples)) * left_out, axis=1)
