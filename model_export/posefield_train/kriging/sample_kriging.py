"""Kriging of the samples of a family: dense, or projected onto inducing clips where they are many.

A projected model is stored as a dense one of its inducing clips, with the values that give its
weights: the graph, the card and all their readers have m clips in place of n (decision 0064).
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np

from posefield.common.units import Floats, Indices, SampleMatrix, Samples, SampleValues
from posefield.kriging import kriging_model
from posefield_train.kriging import universal_kriging
from posefield_train.kriging.sample_points import SamplePoints
from posefield_train.kriging.universal_kriging import Hyper, UniversalKriging

JITTER = 1e-3
"""Share of the sill added to inducing covariances, so that the form of sigma fits float32."""


@dataclass(frozen=True)
class ProjectedProcess:
    """The projected process of samples (n, d + p) and inducing points (m, d + p).

    hyper: parameters with one drift and a nugget above zero. jitter: added to the inducing
    covariances, in sills.
    """

    hyper: Hyper
    samples: Samples
    inducing: Annotated[Floats, "inducing coordinates"]
    jitter: float = JITTER

    def __post_init__(self) -> None:
        if len(self.hyper.drifts) != 1 or self.hyper.nugget <= 0.0:
            found = f"drifts {self.hyper.drifts} and nugget {self.hyper.nugget:g}"
            raise ValueError(f"{found}, expected one drift and a nugget above zero")

    def dual(self, values: SampleValues) -> Annotated[Floats, "system values"]:
        """Return the weights (m + k, v) of covariances and drift functions for values (n, v)."""
        left, right = self._factors
        found = np.linalg.solve(right, left.T @ values)
        free = self._allowed.shape[1]
        return np.vstack([self._allowed @ found[:free], found[free:]])

    def leave_out(self, groups: Annotated[Indices, "samples"]) -> SampleMatrix:
        """Return the matrix (n, n) from values to residuals of samples left out by groups (n,).

        The inducing points remain. Closed form of penalised least squares: the residuals of a group
        are (I - H)⁻¹ times its own, with the matrix H from values to predictions.
        """
        left = self._factors[0]
        apart = np.eye(len(left)) - left @ left.T
        return kriging_model.divide_groups(apart, apart, kriging_model.equal_sized_groups(groups))

    def residuals(
        self, values: SampleValues, groups: Annotated[Indices, "samples"]
    ) -> SampleValues:
        """Return `leave_out` times values (n, v), without a matrix (n, n)."""
        left = self._factors[0]
        found: Floats = values - left @ (left.T @ values)
        several = kriging_model.equal_sized_groups(groups)
        grouped = [
            np.linalg.solve(np.eye(own.shape[1]) - left[own] @ left[own].swapaxes(1, 2), found[own])
            for own in several
        ]
        found /= (1.0 - np.sum(np.square(left), axis=1))[:, None]
        for own, rows in zip(several, grouped, strict=True):
            found[own] = rows
        return found

    @property
    def form(self) -> Annotated[Floats, "system system"]:
        """Return the quadratic form (m + k, m + k) by which the samples reduce the variance.

        It is that of the deterministic training conditional with a drift (Quiñonero-Candela &
        Rasmussen 2005): far from the inducing points nothing is subtracted from the prior.
        """
        nugget, m, near = self.hyper.nugget, len(self.inducing), self._near
        own = self._inducing_covariances
        inverse = np.linalg.inv(near.T @ near + nugget * own)
        toward = -inverse @ (near.T @ self._drift)
        system = np.vstack([toward, np.eye(self._drift.shape[1])])
        unsure = (self._drift.T @ self._drift + self._drift.T @ near @ toward) / nugget
        found = -system @ np.linalg.solve(unsure, system.T)
        found[:m, :m] += np.linalg.inv(own) - nugget * inverse
        return np.asarray(0.5 * (found + found.T))

    @cached_property
    def _near(self) -> Annotated[Floats, "samples inducing"]:
        return kriging_model.covariances(self.hyper, self.samples, self.inducing)

    @cached_property
    def _drift(self) -> Annotated[Floats, "samples functions"]:
        return kriging_model.drift(self.samples, len(self.hyper.scales), self.hyper.drifts[0])

    @cached_property
    def _inducing_covariances(self) -> Annotated[Floats, "inducing inducing"]:
        own = kriging_model.covariances(self.hyper, self.inducing, self.inducing)
        return own + self.jitter * np.eye(len(own))

    @cached_property
    def _allowed(self) -> Annotated[Floats, "inducing free"]:
        """Return an orthonormal basis (m, m - k) of weights orthogonal to the inducing drift."""
        functions = kriging_model.drift(self.inducing, len(self.hyper.scales), self.hyper.drifts[0])
        return np.linalg.qr(functions, mode="complete")[0][:, functions.shape[1] :]

    @cached_property
    def _factors(self) -> tuple[Annotated[Floats, "samples _"], Annotated[Floats, "_ _"]]:
        """Return the first n rows of the orthogonal factor of the least squares, and the other.

        Products of covariances would square their condition.
        """
        n, free = len(self.samples), self._allowed.shape[1]
        penalty = self._allowed.T @ self._inducing_covariances @ self._allowed
        sizes, turns = np.linalg.eigh(penalty)
        root = np.sqrt(self.hyper.nugget * np.maximum(sizes, 0.0))[:, None] * turns.T
        data = np.hstack([self._near @ self._allowed, self._drift])
        rest = np.hstack([root, np.zeros((free, self._drift.shape[1]))])
        left, right = np.linalg.qr(np.vstack([data, rest]))
        return left[:n], right


def solve(hyper: Hyper, samples: SamplePoints, values: SampleValues) -> UniversalKriging:
    """Return the kriging model of values (n, m) at samples, over the inducing clips if there are.

    Its sample values are then those that all clips together give the inducing ones.
    """
    if samples.inducing is None:
        return universal_kriging.solve(hyper, samples.points, values)
    inducing = samples.points[samples.inducing]
    process = ProjectedProcess(hyper, samples.points, inducing)
    weighing = kriging_model.weight_matrix(hyper, inducing)
    return UniversalKriging(hyper, inducing, process.dual(values), weighing, process.form)


def leave_out(
    hyper: Hyper, samples: SamplePoints, kept: Annotated[Indices, "kept"] | None = None
) -> SampleMatrix:
    """Return the matrix (n, n) from values to leave-one-group-out residuals.

    kept: samples that the family consists of; all if None. Inducing clips remain inducing.
    """
    own = np.arange(len(samples.points)) if kept is None else kept
    points, groups = samples.points[own], samples.groups[own]
    if samples.inducing is None:
        return universal_kriging.leave_out(hyper, points, groups)
    process = ProjectedProcess(hyper, points, samples.points[samples.inducing])
    return process.leave_out(groups)


def residuals(hyper: Hyper, samples: SamplePoints, values: SampleValues) -> SampleValues:
    """Return the leave-one-group-out residuals (n, m) of values (n, m)."""
    if samples.inducing is None:
        return leave_out(hyper, samples) @ values
    process = ProjectedProcess(hyper, samples.points, samples.points[samples.inducing])
    return process.residuals(values, samples.groups)
