"""Universal kriging of many values at once, in its dual form (Mukai & Kuriyama 2006, section 2).

The dual weights of the system (posefield.kriging.kriging_model) answer a query by one product; its
inverse gives the variance.

The nugget is filtered: it is on the diagonal of the system only, so that the
prediction is continuous in the controls.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np

from posefield.common.errors import TrainingError
from posefield.common.units import (
    Floats,
    Indices,
    PerPoint,
    Points,
    PointSamples,
    PointValues,
    SampleMatrix,
    Samples,
    SampleValues,
)
from posefield.kriging import kriging_model
from posefield.kriging.kriging_model import Hyper
from posefield_train.kriging.sample_points import SamplePoints


@dataclass(frozen=True)
class UniversalKriging:
    """A solved kriging model.

    samples: (n, d + p). dual: weights (n + k, m) of the values. weighing: (n + k, n), maps values
    to dual weights. form: quadratic form (n + k, n + k) of the variance.

    A point is d controls and p labels, one-hot for a performer and zero for an unseen performer.
    """

    hyper: Hyper
    samples: Samples
    dual: Annotated[Floats, "system values"]
    weighing: Annotated[Floats, "system samples"]
    form: Annotated[Floats, "system system"]

    def predict(self, points: Points) -> PointValues:
        """Return values (B, m) at points (B, d + p)."""
        return self._basis(points) @ self.dual

    def weights(self, points: Points) -> PointSamples:
        """Return the weight of each sample (B, n); they sum to one, and may be negative."""
        return self._basis(points) @ self.weighing

    def variance(self, points: Points) -> PerPoint:
        """Return the kriging variance (B,) of the filtered model, as a share of the sill."""
        basis, prior = self._basis(points), kriging_model.prior_variances(self.hyper, points)
        return prior - np.sum(basis @ self.form * basis, axis=1)

    @property
    def values(self) -> SampleValues:
        """Return the sample values (n, m) that the model was solved for."""
        return values(self.hyper, self.samples, self.dual)

    def _basis(self, points: Points) -> Annotated[Floats, "points system"]:
        return kriging_model.basis_functions(self.hyper, points, self.samples)


def solve(hyper: Hyper, samples: Samples, values: SampleValues) -> UniversalKriging:
    """Return the kriging model of values (n, m) at samples (n, d + p).

    `check_samples` the samples first.

    With more than one drift the weights are averaged, and the variance is that of their average.
    """
    n, functions = len(samples), 1 + max(hyper.drifts) * len(hyper.scales)
    weighing = kriging_model.weight_matrix(hyper, samples)
    toward = np.vstack([np.eye(n), np.zeros((functions, n))]) @ weighing.T
    form = toward + toward.T - weighing @ kriging_model.noisy(hyper, samples) @ weighing.T
    return UniversalKriging(hyper, samples, weighing @ values, weighing, form)


def values(
    hyper: Hyper, samples: Samples, dual: Annotated[Floats, "system values"]
) -> SampleValues:
    """Return the sample values (n, m) for dual weights (n + k, m): the system times the weights."""
    n, degree = len(samples), max(hyper.drifts)
    functions = kriging_model.drift(samples, len(hyper.scales), degree)
    return kriging_model.noisy(hyper, samples) @ dual[:n] + functions @ dual[n:]


def check_samples(
    samples: Annotated[Floats, "samples {len(names)}"],
    names: tuple[str, ...],
    degree: int,
    nugget_is_zero: bool,
) -> None:
    """Raise TrainingError for samples that make the kriging system singular.

    These are fewer samples than drift functions plus one, a control with a single value, linearly
    dependent controls, and, with a nugget of zero, two samples at one point.
    """
    count, needed = len(samples), len(names) * degree + 2
    if count < needed:
        raise TrainingError(
            f"{count} samples, expected at least {needed} for {len(names)} controls and a drift "
            f"of degree {degree}"
        )
    for name, column in zip(names, samples.T, strict=True):
        if np.ptp(column) == 0:
            raise TrainingError(
                f"control {name!r} has the value {column[0]:g} in all {count} samples, expected "
                "at least two values; leave it out of the recipe"
            )
    if (
        np.linalg.matrix_rank(kriging_model.drift(samples, len(names), degree))
        < 1 + len(names) * degree
    ):
        raise TrainingError(f"controls {names}: one of them follows linearly from the others")
    if nugget_is_zero:
        _, first, inverse = np.unique(samples, axis=0, return_index=True, return_inverse=True)
        for row, group in enumerate(np.ravel(inverse)):
            if first[group] != row:
                raise TrainingError(
                    f"samples {first[group] + 1} and {row + 1} have equal controls: a nugget of "
                    "zero expects them to differ; allow a nugget, or leave one out"
                )


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
            parameters = f"drifts {self.hyper.drifts} and nugget {self.hyper.nugget:g}"
            raise ValueError(f"{parameters}, expected one drift and a nugget above zero")

    def dual(self, values: SampleValues) -> Annotated[Floats, "system values"]:
        """Return the weights (m + k, v) of covariances and drift functions for values (n, v)."""
        left, right = self._factors
        weights = np.linalg.solve(right, left.T @ values)
        free = self._allowed.shape[1]
        return np.vstack([self._allowed @ weights[:free], weights[free:]])

    def leave_out(self, groups: Annotated[Indices, "samples"]) -> SampleMatrix:
        """Return the matrix (n, n) from values to residuals of samples left out by groups (n,).

        The inducing points remain. Closed form of penalised least squares: the residuals of a group
        are (I - H)⁻¹ times its own, with the matrix H from values to predictions.
        """
        left = self._factors[0]
        complement = np.eye(len(left)) - left @ left.T
        return kriging_model.divide_groups(
            complement, complement, kriging_model.equal_sized_groups(groups)
        )

    def residuals(
        self, values: SampleValues, groups: Annotated[Indices, "samples"]
    ) -> SampleValues:
        """Return `leave_out` times values (n, v), without a matrix (n, n)."""
        left = self._factors[0]
        residuals: Floats = values - left @ (left.T @ values)
        several = kriging_model.equal_sized_groups(groups)
        grouped = [
            np.linalg.solve(
                np.eye(indices.shape[1]) - left[indices] @ left[indices].swapaxes(1, 2),
                residuals[indices],
            )
            for indices in several
        ]
        residuals /= (1.0 - np.sum(np.square(left), axis=1))[:, None]
        for indices, rows in zip(several, grouped, strict=True):
            residuals[indices] = rows
        return residuals

    @property
    def form(self) -> Annotated[Floats, "system system"]:
        """Return the quadratic form (m + k, m + k) by which the samples reduce the variance.

        It is that of the deterministic training conditional with a drift (Quiñonero-Candela &
        Rasmussen 2005): far from the inducing points nothing is subtracted from the prior.
        """
        nugget, m, near = self.hyper.nugget, len(self.inducing), self._near
        covariances = self._inducing_covariances
        inverse = np.linalg.inv(near.T @ near + nugget * covariances)
        toward = -inverse @ (near.T @ self._drift)
        system = np.vstack([toward, np.eye(self._drift.shape[1])])
        unsure = (self._drift.T @ self._drift + self._drift.T @ near @ toward) / nugget
        form = -system @ np.linalg.solve(unsure, system.T)
        form[:m, :m] += np.linalg.inv(covariances) - nugget * inverse
        return np.asarray(0.5 * (form + form.T))

    @cached_property
    def _near(self) -> Annotated[Floats, "samples inducing"]:
        return kriging_model.covariances(self.hyper, self.samples, self.inducing)

    @cached_property
    def _drift(self) -> Annotated[Floats, "samples functions"]:
        return kriging_model.drift(self.samples, len(self.hyper.scales), self.hyper.drifts[0])

    @cached_property
    def _inducing_covariances(self) -> Annotated[Floats, "inducing inducing"]:
        covariances = kriging_model.covariances(self.hyper, self.inducing, self.inducing)
        return covariances + self.jitter * np.eye(len(covariances))

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


def solve_samples(hyper: Hyper, samples: SamplePoints, values: SampleValues) -> UniversalKriging:
    """Return the kriging model of values (n, m) at samples, over the inducing clips if there are.

    Its sample values are then those that all clips together give the inducing ones.
    """
    if samples.inducing is None:
        return solve(hyper, samples.points, values)
    inducing = samples.points[samples.inducing]
    process = ProjectedProcess(hyper, samples.points, inducing)
    weighing = kriging_model.weight_matrix(hyper, inducing)
    return UniversalKriging(hyper, inducing, process.dual(values), weighing, process.form)


def leave_out_samples(
    hyper: Hyper, samples: SamplePoints, chosen: Annotated[Indices, "kept"] | None = None
) -> SampleMatrix:
    """Return the matrix (n, n) from values to leave-one-group-out residuals.

    chosen: samples that the family consists of; all if None. Inducing clips remain inducing.
    """
    indices = np.arange(len(samples.points)) if chosen is None else chosen
    points, groups = samples.points[indices], samples.groups[indices]
    if samples.inducing is None:
        return kriging_model.leave_out(hyper, points, groups)
    process = ProjectedProcess(hyper, points, samples.points[samples.inducing])
    return process.leave_out(groups)


def left_out_residuals(hyper: Hyper, samples: SamplePoints, values: SampleValues) -> SampleValues:
    """Return the leave-one-group-out residuals (n, m) of values (n, m)."""
    if samples.inducing is None:
        return leave_out_samples(hyper, samples) @ values
    process = ProjectedProcess(hyper, samples.points, samples.points[samples.inducing])
    return process.residuals(values, samples.groups)
