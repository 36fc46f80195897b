"""What a value of the kriged field is made of: distances to the samples, and the weights of each.

The system is [[C + nugget I, F], [Fᵀ, 0]] with covariance C between samples and drift F. Its
inverse says what each sample counts for at a point: the same in training, which makes of it the
numbers that a model file holds, and in the service, which is asked why.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from service.motion.conventions import Floats, Indices
from service.motion.covariance import FORMULAS


@dataclass(frozen=True)
class Hyper:
    """covariance: its name. drifts: polynomial degrees, 0 or 1, whose predictions are averaged.
    scales (d,): what a unit of each control is worth as distance (one over the range). nugget: as
    a share of the sill. label: the distance between two performers who are told apart, who never
    enter the drift."""

    covariance: str
    drifts: tuple[int, ...]
    scales: Floats
    nugget: float
    label: float = 0.0


@dataclass(frozen=True)
class Weigher:
    """Samples (n, d + p) and what each counts for: d controls in half-ranges and p labels, of which
    the performer's own is one and the others zero; all are zero for somebody who was never seen."""

    hyper: Hyper
    samples: Floats

    @cached_property
    def weighing(self) -> Floats:
        """Weights (n + k, n) of covariances and drift functions for each sample."""
        return weighing(self.hyper, self.samples)

    def weights(self, points: Floats) -> Floats:
        """What each sample counts for (B, n): they add up to one, and may be negative."""
        return basis(self.hyper, points, self.samples) @ self.weighing

    def distances(self, points: Floats) -> Floats:
        """Distances (B, n) to the samples; at one, 5 % of the covariance is left."""
        return np.sqrt(squared_distances(self.hyper, points, self.samples))


def half_ranges(controls: Floats, low: Floats, high: Floats) -> Floats:
    """Controls (B, d) on a scale where the range from low to high (d,) is -1 to 1."""
    return (2.0 * controls - low - high) / (high - low)


def squared_distances(hyper: Hyper, a: Floats, b: Floats) -> Floats:
    """Squared distances (A, B) between points (A, d + p) and (B, d + p).

    Different performers are `label` apart, whoever they are: the product of their labels is 0, and
    1 for the same one.
    """
    d = len(hyper.scales)
    gaps = (a[:, None, :d] - b[None, :, :d]) * hyper.scales
    others = 1.0 - a[:, d:] @ b[:, d:].T
    return np.sum(np.square(gaps), axis=-1) + hyper.label**2 * others


def covariances(hyper: Hyper, a: Floats, b: Floats) -> Floats:
    """Covariance (A, B) between points (A, d + p) and (B, d + p)."""
    return FORMULAS[hyper.covariance](squared_distances(hyper, a, b))


def drift(points: Floats, controls: int, degree: int) -> Floats:
    """Drift functions (B, k) at points (B, d + p): a constant, and the controls for degree one."""
    one = np.ones((len(points), 1))
    return np.hstack([one, points[:, :controls]]) if degree else one


def needed(groups: Indices, functions: Floats) -> int | None:
    """First group of samples (n,) without which the others' drift functions (n, k) do not determine
    a drift; None where any may be left out."""
    for group in np.unique(groups):
        if np.linalg.matrix_rank(functions[groups != group]) < functions.shape[1]:
            return int(group)
    return None


def basis(hyper: Hyper, points: Floats, samples: Floats) -> Floats:
    """Covariances with all samples and drift functions (B, n + k) at points (B, d + p)."""
    near = covariances(hyper, points, samples)
    return np.hstack([near, drift(points, len(hyper.scales), max(hyper.drifts))])


def noisy(hyper: Hyper, samples: Floats) -> Floats:
    """Covariance (n, n) of measured samples: that of the field, and the nugget."""
    return covariances(hyper, samples, samples) + hyper.nugget * np.eye(len(samples))


def invert(hyper: Hyper, samples: Floats, degree: int) -> Floats:
    """Inverse (n + k, n + k) of the kriging system with a drift of that degree."""
    f = drift(samples, len(hyper.scales), degree)
    n, k = f.shape
    system = np.zeros((n + k, n + k))
    system[:n, :n] = noisy(hyper, samples)
    system[:n, n:], system[n:, :n] = f, f.T
    return np.linalg.inv(system)


def weighing(hyper: Hyper, samples: Floats) -> Floats:
    """What each covariance and drift function counts for in each sample's weight (n + k, n).

    With more than one drift the weights are averaged.
    """
    n, functions = len(samples), 1 + max(hyper.drifts) * len(hyper.scales)
    found = np.zeros((n + functions, n))
    for degree in hyper.drifts:
        own = invert(hyper, samples, degree)[:, :n]
        found[: len(own)] += own / len(hyper.drifts)
    return found


def leave_out(hyper: Hyper, samples: Floats, groups: Indices) -> Floats:
    """Matrix (n, n) from values to residuals of each sample predicted from all other groups.

    groups (n,): samples that say too much of each other, such as strides of one take, are left
    out together. Closed form from the inverse of the whole system (Dubrule, "Cross validation of
    kriging in a unique neighborhood", Math. Geology 1983, for blocks).
    """
    inverse = np.asarray(np.linalg.inv(noisy(hyper, samples)), dtype=np.float64)
    residuals = {
        degree: _left_out(_without(inverse, drift(samples, len(hyper.scales), degree)), groups)
        for degree in sorted(set(hyper.drifts))
    }
    return np.mean(np.stack([residuals[degree] for degree in hyper.drifts]), axis=0)


def _without(inverse: Floats, functions: Floats) -> Floats:
    """Block (n, n) of the whole system's inverse, from that of the covariances (n, n).

    functions (n, k): of the drift. One inverse serves the drifts of all degrees.
    """
    weighed = inverse @ functions
    return inverse - weighed @ np.linalg.solve(functions.T @ weighed, weighed.T)


def _left_out(block: Floats, groups: Indices) -> Floats:
    residual = block / np.diagonal(block)[:, None]
    _, names, sizes = np.unique(groups, return_inverse=True, return_counts=True)
    order = np.argsort(names, kind="stable")
    for size in np.unique(sizes[sizes > 1]):
        # Groups of one size, a row each.
        own = order[sizes[names[order]] == size].reshape(-1, size)
        among = block[own[:, :, None], own[:, None, :]]
        residual[own] = np.linalg.solve(among, block[own])
    return residual


def left_out_variances(hyper: Hyper, samples: Floats, left_out: Floats) -> Floats:
    """Variances (n,) of residuals by a matrix (n, n) of `leave_out`, the nugget counted in, as
    shares of the sill."""
    return np.sum((left_out @ noisy(hyper, samples)) * left_out, axis=1)
