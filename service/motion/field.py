"""What a value of the kriged field is made of: distances to the samples, and the weights of each.

The system is [[C + nugget I, F], [Fᵀ, 0]] with covariance C between samples and drift F. Its
inverse says what each sample counts for at a point: the same in training, which makes of it the
numbers that a model file holds, and in the service, which is asked why.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from service.motion.conventions import Floats
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
