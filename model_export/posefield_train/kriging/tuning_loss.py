"""Loss of a kriging model's parameters: closed-form leave-one-out residuals and a prior.

It is the logarithm of the squared leave-one-out residuals, which is the negative logarithm of their
likelihood with an unknown variance, less the logarithm of the parameters' prior. Few samples leave
the parameters undetermined; the prior decides between those that fit alike.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Annotated

import numpy as np
from scipy.special import expit

from posefield.common.units import Booleans, Floats, Indices, SampleMatrix, SampleValues
from posefield.kriging import kriging_model
from posefield.kriging.kriging_model import Hyper, LabelKernel
from posefield_train.kriging import sample_points
from posefield_train.kriging.kriging_graph import COVARIANCES
from posefield_train.kriging.sample_points import SamplePoints


@dataclass(frozen=True)
class ParameterPrior:
    """Bounds of a parameter, and the mean and deviation of its normal prior, in search units.

    Search units are logarithms, and log odds for the correlation.
    """

    low: float
    high: float
    mean: float
    deviation: float


def _in_logarithms(low: float, high: float, mean: float, deviation: float) -> ParameterPrior:
    return ParameterPrior(np.log(low), np.log(high), np.log(mean), deviation)


# In float32 samples would coincide beyond the bounds of scales, per half-range of a control.
SCALE_PRIOR = _in_logarithms(0.1, 3.0, 0.45, 0.7)
PRIORS = {
    "nugget": _in_logarithms(1e-3, 10.0, 0.1, 1.5),
    "correlation": ParameterPrior(-6.0, 5.0, 0.0, 2.0),
    "offset": _in_logarithms(1e-3, 30.0, 0.3, 2.0),
    "trend": _in_logarithms(1e-3, 300.0, 1.0, 2.5),
}
"""Priors of the parameters besides the scales, in the order of the search.

Each label set has a correlation and an offset of its own with these priors.
"""


def _without_names() -> ParameterPrior:
    """Return the prior of the nugget where performers have no names.

    It is that of the model with names, for two clips of unknown performers: what a performer adds
    to the covariance is noise, and the sill is what remains common to all.
    """
    offset, nugget = np.exp(PRIORS["offset"].mean), np.exp(PRIORS["nugget"].mean)
    common = float(expit(PRIORS["correlation"].mean))
    return replace(PRIORS["nugget"], mean=float(np.log((nugget + offset + 1.0 - common) / common)))


UNNAMED_NUGGET = _without_names()
"""Prior of the pose's nugget where several performers have no names: 1.8 instead of 0.1."""
Parameter = tuple[str, int]
"""Name of a parameter, and the index of its label set; 0 for the others."""
# Least sum of squares: a drift may fit all values exactly.
TINY = float(np.finfo(np.float64).tiny)
POSE_STRENGTH, OTHER_STRENGTH, UNNAMED_STRENGTH = 2.0, 1.0, 1.0
"""Weight of the prior for the pose, for the few values of other quantities, and for the pose where
several performers have no names: how much they differ there is less certain."""


@dataclass(frozen=True)
class TuningProblem:
    """Values (n, m) in a Euclidean metric, and what is known of their kriging model.

    nugget: fixed value; None to tune it. effector: matrices (n, k, m') that map the first m'
    residuals of each sample to weighted displacements of the event's joint, or None. unnamed: the
    samples are of several performers who have no names, and their differences are noise.
    """

    samples: SamplePoints
    values: SampleValues
    nugget: float | None = None
    effector: Annotated[Floats, "samples _ _"] | None = None
    strength: float = POSE_STRENGTH
    unnamed: bool = False

    def drawn(self, draw: int) -> "TuningProblem":
        """Return the problem of some clips of a large family; itself for others.

        draw: 0 or 1. The values keep their inner products, and the first those that the effector
        moves.
        """
        samples = self.samples
        if len(samples.points) <= sample_points.LARGEST_TUNED:
            return self
        rows = sample_points.choose_tuned(samples.points, samples.controls, samples.labels, draw)
        effector = None if self.effector is None else self.effector[rows]
        first = 0 if effector is None else effector.shape[2]
        some = self.values[rows]
        values = np.hstack([some[:, :first], _compact(some[:, first:])])
        return replace(self, samples=samples.subset(rows), values=values, effector=effector)

    def prior(self, name: str) -> ParameterPrior:
        """Return the prior of a parameter besides the scales."""
        return UNNAMED_NUGGET if self.unnamed and name == "nugget" else PRIORS[name]


@dataclass(frozen=True)
class LeaveOneOutLoss:
    """Loss of parameters in search units: scales if own, then those named."""

    problem: TuningProblem
    hyper: Hyper
    names: tuple[Parameter, ...]
    own_scales: bool
    priors: list[ParameterPrior] = field(init=False)

    def __post_init__(self) -> None:
        scales = [SCALE_PRIOR] * (self.problem.samples.controls if self.own_scales else 0)
        parameters = (name for name, _ in self.names)
        object.__setattr__(self, "priors", scales + list(map(self.problem.prior, parameters)))

    def start(self, scale: float, nugget: float) -> Annotated[Floats, "units"]:
        """Return a start of the search from the logarithms of a scale and a nugget."""
        means = np.array([prior.mean for prior in self.priors])
        if self.own_scales:
            means[: self.problem.samples.controls] = scale
        if NUGGET in self.names:
            means[self._place(NUGGET)] = nugget
        return means

    def _place(self, name: Parameter) -> int:
        return len(self.priors) - len(self.names) + self.names.index(name)

    def read(self, x: Annotated[Floats, "units"]) -> Hyper:
        """Return the parameters at a point of the search."""
        scales = len(self.priors) - len(self.names)
        values = {name: _value(name, x[self._place(name)]) for name in self.names}
        if self.problem.nugget is not None:
            values[NUGGET] = self.problem.nugget
        hyper = self.hyper
        kernels = (
            LabelKernel(
                kernel.count,
                values.get(("correlation", index), kernel.correlation),
                values.get(("offset", index), kernel.offset),
            )
            for index, kernel in enumerate(hyper.labels)
        )
        return replace(
            hyper,
            scales=np.exp(x[:scales]) if self.own_scales else hyper.scales,
            nugget=values.get(NUGGET, hyper.nugget),
            trend=values.get(TREND, hyper.trend),
            labels=tuple(kernels),
        )

    def value_and_slope(
        self, x: Annotated[Floats, "units"]
    ) -> tuple[float, Annotated[Floats, "units"]]:
        """Return the loss and its gradient in search units."""
        hyper = self.read(x)
        value, slope = self.of_samples(hyper)
        deviations = np.array([prior.deviation for prior in self.priors])
        standardized = (x - [prior.mean for prior in self.priors]) / deviations
        strength = self.problem.strength
        changes = np.array([np.sum(slope * change) for change in self._changes(hyper)])
        return (
            value + 0.5 * strength * float(standardized @ standardized),
            changes + strength * standardized / deviations,
        )

    def of_samples(self, hyper: Hyper) -> tuple[float, SampleMatrix]:
        """Return the loss without the prior, and its derivative (n, n) by the covariances."""
        squares, slope = self._squares(hyper)
        half = 0.5 * len(np.unique(self.problem.samples.groups))
        return half * float(np.log(squares)), half / squares * slope

    def _squares(self, hyper: Hyper) -> tuple[float, Floats]:
        """Return the weighted squared residuals, and their derivative (n, n) by the covariances.

        With the inverse B of the kriging system's sample block and U = B values, the residuals of a
        group g are R_g = B_gg⁻¹ U_g; see the closed form of `leave_out`.
        """
        block = self.inverse(hyper)
        product = block @ self.values
        residuals = kriging_model.divide_groups(block, product, self.recordings)
        weighted = self._weighted(residuals)
        backward = kriging_model.divide_groups(block, weighted, self.recordings)
        paired = np.where(self.together, backward @ residuals.T, 0.0)
        slope = block @ (paired @ block - backward @ product.T)
        return max(float(np.sum(weighted * residuals)), TINY), slope + slope.T

    def inverse(self, hyper: Hyper) -> SampleMatrix:
        """Return the sample block (n, n) of the inverse of the kriging system."""
        points, degree = self.problem.samples.points, max(hyper.drifts)
        inverse: Floats = np.asarray(
            np.linalg.inv(kriging_model.noisy(hyper, points)), dtype=np.float64
        )
        functions = kriging_model.drift(points, len(hyper.scales), degree)
        return kriging_model.sample_block(inverse, functions)

    def _weighted(self, residuals: Floats) -> Floats:
        """Return the residuals (n, m) with the weight of the event's joint added."""
        effector = self.problem.effector
        if effector is None:
            return residuals
        weighted, first = residuals.copy(), effector.shape[2]
        displacements = np.einsum("nkm,nm->nk", effector, residuals[:, :first])
        weighted[:, :first] += np.einsum("nkm,nk->nm", effector, displacements)
        return weighted

    @cached_property
    def values(self) -> Annotated[Floats, "samples _"]:
        """Values (n, m) in at most n coordinates, which keep their inner products."""
        # An effector moves the first of them, which `drawn` keeps as they are.
        values = self.problem.values
        return values if self.problem.effector is not None else _compact(values)

    @cached_property
    def recordings(self) -> list[Annotated[Indices, "_ _"]]:
        """Sample indices (groups, size) of the groups of each size above one."""
        return kriging_model.equal_sized_groups(self.problem.samples.groups)

    @cached_property
    def together(self) -> Annotated[Booleans, "samples samples"]:
        """Matrix (n, n) of truth values: two samples are left out together."""
        groups = self.problem.samples.groups
        return np.asarray(groups[:, None] == groups[None])

    @cached_property
    def _gaps(self) -> Floats:
        """Squared differences (d, n, n) of each control."""
        planes = self.problem.samples.half_ranges.T
        return np.square(np.subtract(planes[:, :, None], planes[:, None, :]))

    @cached_property
    def _same(self) -> list[Floats]:
        """Matrix (n, n) of each label set: one where two samples have one name."""
        points = self.problem.samples.points
        return kriging_model.label_products(self.hyper, points, points)

    def _changes(self, hyper: Hyper) -> list[Floats]:
        """Return the derivatives (n, n) of the covariances by each search unit."""
        controls, model = self.problem.samples.half_ranges, COVARIANCES[hyper.covariance]
        squared = np.tensordot(np.square(hyper.scales), self._gaps, axes=1)
        pairs = zip(hyper.labels, self._same, strict=True)
        shares = [kernel.correlation + (1.0 - kernel.correlation) * same for kernel, same in pairs]
        changes: list[Floats] = []
        if self.own_scales:
            slope = 2.0 * model.slope(squared) * _product(shares)
            scaled = zip(hyper.scales, self._gaps, strict=True)
            changes += [scale**2 * gaps * slope for scale, gaps in scaled]
        by_name: dict[str, Callable[[int], Floats]] = {
            "nugget": lambda _: hyper.nugget * np.eye(len(controls)),
            "correlation": lambda index: (
                # The first factor is the derivative of a share by its log odds.
                (hyper.labels[index].correlation * (1.0 - hyper.labels[index].correlation))
                * model.numpy(squared)
                * (1.0 - self._same[index])
                * _product(shares[:index] + shares[index + 1 :])
            ),
            "offset": lambda index: hyper.labels[index].offset * self._same[index],
            "trend": lambda _: hyper.trend * (controls @ controls.T),
        }
        return changes + [by_name[name](index) for name, index in self.names]


def _compact(values: SampleValues) -> Annotated[Floats, "samples _"]:
    """Return values (n, m) in at most n coordinates, which keep their inner products."""
    if values.shape[1] <= len(values):
        return values
    left, lengths, _ = np.linalg.svd(values, full_matrices=False)
    return np.asarray(left * lengths)


NUGGET, TREND = ("nugget", 0), ("trend", 0)


def _value(name: Parameter, unit: float) -> float:
    return float(expit(unit) if name[0] == "correlation" else np.exp(unit))


def _product(shares: Sequence[Floats]) -> Floats | float:
    product: Floats | float = 1.0
    for share in shares:
        product = product * share
    return product


@dataclass(frozen=True)
class PredictiveDensityLoss(LeaveOneOutLoss):
    """Negative logarithm of the density that left-out recordings have by the others' predictions.

    The squared residuals of a single value say little about the nugget: a model that follows every
    sample and one that smooths them may miss alike. The density also asks whether the variances
    that the model states fit the residuals (Rasmussen & Williams 2006, section 5.4.2); here whole
    takes are left out, with the sill that fits best. The event's joint has no weight.
    """

    def of_samples(self, hyper: Hyper) -> tuple[float, SampleMatrix]:
        """Return the loss without the prior, and its derivative (n, n) by the covariances.

        With B and U as in `LeaveOneOutLoss` a recording's residuals B_gg⁻¹ U_g have the covariance
        B_gg⁻¹, in units of the sill. Of several values the loss is that of their mean density.
        """
        block = self.inverse(hyper)
        product = block @ self.values
        residuals = kriging_model.divide_groups(block, product, self.recordings)
        diagonal = np.where(self.together, block, 0.0)
        squares, count = max(float(np.sum(residuals * product)), TINY), len(block)
        loss = 0.5 * count * float(np.log(squares)) - 0.5 * float(np.linalg.slogdet(diagonal)[1])
        paired = np.where(self.together, residuals @ residuals.T, 0.0)
        slope = block @ paired @ block - 2.0 * (block @ residuals) @ product.T
        spread = block @ np.linalg.inv(diagonal) @ block
        both = 0.5 * count / squares * slope + 0.5 * spread
        return loss, 0.5 * (both + both.T)


@dataclass(frozen=True)
class PoseLoss(PredictiveDensityLoss):
    """Sum of the losses of squared residuals and of density.

    Of many values the squared residuals alone leave the model too sure of its samples; the density
    alone says nothing of the event's joint.
    """

    def of_samples(self, hyper: Hyper) -> tuple[float, SampleMatrix]:
        """Return the loss without the prior, and its derivative (n, n) by the covariances."""
        pairs = LeaveOneOutLoss.of_samples(self, hyper), super().of_samples(hyper)
        (squares, first), (density, second) = pairs
        return squares + density, first + second
