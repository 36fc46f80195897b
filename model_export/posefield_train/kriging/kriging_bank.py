"""Kriging models of all quantities over the same samples, evaluated in one pass.

Pose coefficients, bone offsets, duration and time warp share the stationary part of their
covariances, so that a query computes one covariance for each sample. Each has a nugget, an offset
and a trend of its own. A quantity that the controls do not explain is constant. Coarser levels of
detail use only the first covariances, at the most informative samples, with separate weights for
all quantities that fit the full models by least squares.
"""

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Annotated

import numpy as np

from posefield.common.units import (
    Floats,
    Indices,
    PerControl,
    PerPoint,
    PointControls,
    PointLabels,
    Points,
    PointValues,
    SampleControls,
    SampleValues,
    Values,
)
from posefield.kriging import kriging_model
from posefield.kriging.kriging_model import Hyper
from posefield.kriging.support import half_ranges
from posefield_train.kriging.sample_points import LabelNames, SamplePoints
from posefield_train.kriging.universal_kriging import UniversalKriging
from posefield_train.onnx_graph import REGISTER, GraphBuilder

# Controls over a smaller ratio are nearly linear in their logarithms.
SMALLEST_RATIO = 1.3
NUGGETS = (0.01, 0.1, 1.0, 10.0)
# The powers are taken where they leave less than this share of the squared residuals.
CLEAR_SHARE = 0.5


@dataclass(frozen=True)
class PowerLaw:
    """Exponents (d,) of the controls, zero for controls without; floor (d,) of their values."""

    exponents: PerControl
    floor: PerControl

    def logarithms(self, controls: PointControls) -> Annotated[Floats, "points 1"]:
        """Return the logarithm (B, 1) of the product at controls (B, d) in their own units."""
        used = self.exponents != 0.0
        powers = np.log(np.maximum(controls[:, used], self.floor[used]))
        return np.asarray(powers @ self.exponents[used])[:, None]

    def onnx(self, net: GraphBuilder, controls: str) -> str:
        """Build `logarithms` in a graph.

        Each row is widened to whole registers by a product with ones and zeros, which is exact: the
        last numbers of a partly filled register round differently in a logarithm.
        """
        count = len(self.exponents)
        width = -(-count // REGISTER) * REGISTER
        wide = net("MatMul", controls, net.weights("duration_places", np.eye(count, width)))
        # Controls without exponent may be negative: one replaces them, whose logarithm is zero.
        floor = np.append(self.floor, np.ones(width - count))
        above = net("Max", wide, net.weights("duration_floor", floor))
        exponents = np.append(self.exponents, np.zeros(width - count))
        pairs = np.stack([exponents, exponents], axis=1)
        return net.row_sums(net("Log", above), net.weights("duration_exponents", pairs))


@dataclass(frozen=True)
class PowerLawFit:
    """A power law, the kriging parameters of what it leaves, and leave-one-out residuals (N, 1)."""

    law: PowerLaw
    hyper: Hyper
    residuals: Annotated[Floats, "samples 1"]


def fit_power_law(
    pose: Hyper,
    samples: SamplePoints,
    controls: SampleControls,
    logs: Annotated[Floats, "samples 1"],
    residuals: Annotated[Floats, "samples 1"],
) -> PowerLawFit | None:
    """Return the power law of logarithms (N, 1) of durations, or None if it is not clearly better.

    pose: model whose scales and correlation it shares. controls: (N, d), in their own units.
    residuals: leave-one-out residuals (N, 1) of a model without powers.
    """
    low, high = controls.min(axis=0), controls.max(axis=0)
    used = (low > 0.0) & (high > SMALLEST_RATIO * np.maximum(low, 0.0))
    if not used.any():
        return None
    functions = np.hstack([np.ones((len(controls), 1)), np.log(controls[:, used])])
    if kriging_model.find_required_group(samples.groups, functions) is not None:
        return None
    fits = []
    for nugget in NUGGETS:
        hyper = replace(pose.without_offsets(), drifts=(0,), nugget=nugget, trend=0.0)
        inverse: Floats = np.asarray(
            np.linalg.inv(kriging_model.noisy(hyper, samples.points)), dtype=np.float64
        )
        left_out = kriging_model.residual_matrix(inverse, functions, samples.groups) @ logs
        weighed = inverse @ functions
        slopes = np.linalg.solve(functions.T @ weighed, weighed.T @ logs)[1:, 0]
        fits.append((float(np.sum(np.square(left_out))), hyper, slopes, left_out))
    squares, hyper, slopes, left_out = min(fits, key=lambda fit: fit[0])
    if squares >= CLEAR_SHARE * float(np.sum(np.square(residuals))):
        return None
    exponents, floor = np.zeros(len(low)), np.ones(len(low))
    exponents[used], floor[used] = slopes, 0.5 * low[used]
    return PowerLawFit(PowerLaw(exponents, floor), hyper, left_out)


@dataclass(frozen=True)
class ConstantModel:
    """A coefficient model (m,) that does not depend on the controls."""

    mean: Values

    def predict(self, points: Points) -> PointValues:
        """Return values (B, m) at points (B, d)."""
        return np.repeat(self.mean[None], len(points), axis=0)


CoefficientModel = UniversalKriging | ConstantModel

VARIANCE, POSE, DURATION, EVENT = "variance", "pose", "duration", "event"


def width(field: CoefficientModel) -> int:
    """Return the number of values of a coefficient model."""
    return len(field.mean) if isinstance(field, ConstantModel) else field.dual.shape[1]


@dataclass(frozen=True)
class KrigingBank:
    """Coefficient models by name over controls sampled in the ranges low to high (d,).

    labels: names of each label set. sill: of the pose model, m² per joint and frame. coarse:
    weights (p + 1 + d + m, M) of each coarser level. Rows: labels, one, controls and the first m
    covariances. Columns: the logarithm of the variance, the other quantities, the pose's leading
    coefficients. power_law: of the duration, beside its model. event: second model of the pose's
    leading coefficients, for the time around the event, at the finest level. contacts: model of the
    coefficients of the contacts with the pose's parameters, and so its weights, at every level.
    """

    low: PerControl
    high: PerControl
    labels: LabelNames
    pose: UniversalKriging
    other_models: dict[str, CoefficientModel]
    sill: float
    coarse: tuple[Annotated[Floats, "rows columns"], ...] = ()
    power_law: PowerLaw | None = None
    event: UniversalKriging | None = None
    contacts: UniversalKriging | None = None

    @property
    def event_columns(self) -> int:
        """Return the number of pose coefficients with a second model for the event."""
        return width(self.event) if self.event else 0

    @property
    def linear(self) -> int:
        """Return the number of labels, one and controls, which precede the covariances."""
        return self.label_count + 1 + len(self.low)

    @property
    def label_count(self) -> int:
        """Return the number of names of all label sets together."""
        return sum(map(len, self.labels.values()))

    def columns(self, level: int) -> int:
        """Return the number of samples, and so of covariances, that a level evaluates."""
        return len(self.coarse[level - 1]) - self.linear if level else len(self.pose.samples)

    def sample_values(self, name: str) -> SampleValues:
        """Return the values (n, m) that a model interpolates, or its mean in every row."""
        field = self.other_models[name]
        if isinstance(field, ConstantModel):
            return field.predict(self.pose.samples)
        return field.values

    def sizes(self, pose: int) -> list[int]:
        """Return the number of values of each quantity, the logarithm of the variance first.

        pose: number of pose coefficients.
        """
        return [1, *map(width, self.other_models.values()), pose]

    def points(self, controls: PointControls, labels: PointLabels) -> Points:
        """Return points (B, d + p): controls (B, d) in half-ranges of their samples, and labels."""
        return np.hstack([half_ranges(controls, self.low, self.high), labels])

    def numpy(self, points: Points, level: int = 0) -> dict[str, Annotated[Floats, "points _"]]:
        """Return values (B, m) of each quantity at points (B, d + p), the variance as a share."""
        thinned = self._thinned(points, self.coarse[level - 1]) if level else self.kriged(points)
        return {**thinned, DURATION: thinned[DURATION] + self.power_logarithms(points)}

    def durations(self, points: Points) -> PerPoint:
        """Return the durations (B,), s, at points (B, d + p), at the finest level."""
        logs = self.other_models[DURATION].predict(points) + self.power_logarithms(points)
        return np.asarray(np.exp(logs[:, 0]))

    def power_logarithms(self, points: Points) -> Annotated[Floats, "points 1"]:
        """Return the part (B, 1) of the logarithm of the duration that the power law gives."""
        if self.power_law is None:
            return np.zeros((len(points), 1))
        middle, half = 0.5 * (self.high + self.low), 0.5 * (self.high - self.low)
        return self.power_law.logarithms(middle + half * points[:, : len(self.low)])

    def kriged(self, points: Points) -> dict[str, Annotated[Floats, "points _"]]:
        """Return values (B, m) of each quantity's kriging model, the variance as a share.

        The pose's coefficients are followed by what the event's model adds to the leading ones.
        """
        variances = self.pose.variance(points)[:, None] + self.pose.hyper.nugget
        values = {name: field.predict(points) for name, field in self.other_models.items()}
        pose = self.pose.predict(points)
        if self.event:
            shifts = self.event.predict(points) - pose[:, : self.event_columns]
            pose = np.hstack([pose, shifts])
        return {VARIANCE: variances, **values, POSE: pose}

    def _thinned(
        self, points: Points, weights: Annotated[Floats, "rows columns"]
    ) -> dict[str, Annotated[Floats, "points _"]]:
        basis = self.basis(points, len(weights) - self.linear)
        bounds = np.cumsum([0, *self.sizes(0)[:-1], weights.shape[1]])
        products = (basis @ weights[:, start:end] for start, end in pairwise(bounds))
        values = dict(zip([VARIANCE, *self.other_models, POSE], products, strict=True))
        return {**values, VARIANCE: np.exp(values[VARIANCE])}

    def basis(self, points: Points, columns: int) -> Annotated[Floats, "points rows"]:
        """Return labels, one, controls and the first covariances (B, p + 1 + d + m)."""
        hyper, samples = self.pose.hyper, self.pose.samples[:columns]
        near = kriging_model.stationary_covariances(hyper, points, samples)
        return np.hstack([kriging_model.linear_functions(hyper, points), near])

    def linear_weights(self, field: CoefficientModel) -> Annotated[Floats, "linear values"]:
        """Return a model's weights (p + 1 + d, m) of labels, one and controls."""
        if isinstance(field, ConstantModel):
            found = np.zeros((self.linear, len(field.mean)))
            found[self.label_count] = field.mean
            return found
        return kriging_model.linear_terms(field.hyper, field.samples) @ field.dual

    def pose_weights(self) -> tuple[Annotated[Floats, "linear _"], Annotated[Floats, "samples _"]]:
        """Return the weights of labels, one and controls, and of the covariances, of the pose.

        Columns: its coefficients, then what the event's model adds to the leading ones.
        """
        linear, n = self.linear_weights(self.pose), len(self.pose.samples)
        dual = self.pose.dual[:n]
        if self.event is None:
            return linear, dual
        first = slice(self.event_columns)
        linear_shift = self.linear_weights(self.event) - linear[:, first]
        return (
            np.hstack([linear, linear_shift]),
            np.hstack([dual, self.event.dual[:n] - dual[:, first]]),
        )

    @property
    def variance_form(self) -> Annotated[Floats, "rows rows"]:
        """Return the quadratic form (p + 1 + d + n, p + 1 + d + n) of the variance in the basis."""
        hyper, p = self.pose.hyper, self.label_count
        terms = kriging_model.linear_terms(hyper, self.pose.samples)
        near = np.eye(len(self.pose.samples), terms.shape[1])
        both = np.vstack([terms, near])
        form = -both @ self.pose.form @ both.T
        form[p, p] += 1.0 + sum(kernel.offset for kernel in hyper.labels) + hyper.nugget
        controls = np.arange(p + 1, self.linear)
        form[controls, controls] += hyper.trend
        return form

    def sigma(self, variance: Annotated[Floats, "points 1"]) -> PerPoint:
        """Return the standard deviation (B,), m, of a captured clip from the prediction.

        variance: share of the sill (B, 1).
        """
        return np.sqrt(self.sill * np.maximum(variance[:, 0], 0.0))


FIT_POINTS = 2_000
# Range of the fit in half-ranges: beyond the samples, so that the weights hold there too.
FIT_RANGE = 1.25
# Directions of the basis below this share of the largest are dropped: their large weights would
# lose precision in float32.
RELATIVE_CUTOFF = 1e-5


def sort_samples(bank: KrigingBank) -> KrigingBank:
    """Return the bank with its samples sorted by how much they explain of the pose."""
    order = pivoted_order(bank.pose)
    other_models = {
        name: field if isinstance(field, ConstantModel) else _permute_kriging(field, order)
        for name, field in bank.other_models.items()
    }
    event = _permute_kriging(bank.event, order) if bank.event else None
    contacts = _permute_kriging(bank.contacts, order) if bank.contacts else None
    pose = _permute_kriging(bank.pose, order)
    return replace(bank, pose=pose, other_models=other_models, event=event, contacts=contacts)


def pivoted_order(pose: UniversalKriging) -> Annotated[Indices, "samples"]:
    """Return samples (n,), each the least determined by the previous ones (pivoted Cholesky)."""
    left = kriging_model.stationary_covariances(pose.hyper, pose.samples, pose.samples)
    pivots: list[int] = []
    for _ in range(len(left)):
        unknown = np.diagonal(left).copy()
        unknown[pivots] = -1.0
        # Rounded, so that rounding errors do not break ties.
        chosen = int(np.argmax(np.round(unknown, 9)))
        pivots.append(chosen)
        if unknown[chosen] > RELATIVE_CUTOFF:
            left = left - np.outer(left[chosen], left[chosen]) / unknown[chosen]
    return np.array(pivots)


def _permute_kriging(
    field: UniversalKriging, order: Annotated[Indices, "samples"]
) -> UniversalKriging:
    rows = np.concatenate([order, np.arange(len(order), len(field.dual))])
    return UniversalKriging(
        field.hyper,
        field.samples[order],
        field.dual[rows],
        field.weighing[np.ix_(rows, order)],
        field.form[np.ix_(rows, rows)],
    )


def random_points(
    bank: KrigingBank, reach: float, count: int
) -> Annotated[Floats, "{count} coordinates"]:
    """Return random points (Q, d + p) within `reach` half-ranges.

    In each label set no name is as likely as each of the names.
    """
    rng = np.random.Generator(np.random.PCG64(count))
    controls = rng.uniform(-reach, reach, (count, len(bank.low)))
    return np.hstack([controls, *random_labels(rng, bank.labels, count)])


def random_labels(
    rng: np.random.Generator, label_names: LabelNames, count: int
) -> list[Annotated[Floats, "{count} _"]]:
    """Return one-hot weights (Q, .) of random names for each label set; zeros for no name."""
    sizes = map(len, label_names.values())
    return [np.eye(size + 1, size)[rng.integers(0, size + 1, count)] for size in sizes]


@dataclass(frozen=True)
class ThinningData:
    """Fit data of coarser levels: values of a bank's models at points beyond its samples.

    basis: labels, one, controls and all covariances (P, p + 1 + d + m). values: (P, m) by
    name.
    """

    basis: Annotated[Floats, "points rows"]
    values: dict[str, Annotated[Floats, "points _"]]
    bank: KrigingBank

    def weights(self, columns: int, rank: int, error: float) -> Annotated[Floats, "rows columns"]:
        """Return weights (p + 1 + d + m, M) of the first m covariances.

        rank: number of pose coefficients. error: of the level, m, added to its variance.
        """
        logarithms = np.log(self.values[VARIANCE] + error**2 / self.bank.sill)
        values = np.hstack(list({**self.values, VARIANCE: logarithms}.values()))
        count = values.shape[1] - (self.values[POSE].shape[1] - rank)
        columns_of_basis = self.basis[:, : self.bank.linear + columns]
        solution = np.linalg.lstsq(columns_of_basis, values[:, :count], rcond=RELATIVE_CUTOFF)
        return np.asarray(solution[0], np.float64)


def thinning_data(bank: KrigingBank) -> ThinningData:
    """Return the fit data of a bank of one level."""
    points = np.vstack([random_points(bank, FIT_RANGE, FIT_POINTS), bank.pose.samples])
    return ThinningData(bank.basis(points, bank.columns(0)), bank.kriged(points), bank)
