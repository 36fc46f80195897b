"""Tuning of scales and nugget of a kriging model by closed-form leave-one-out."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from scipy.optimize import minimize

from posefield.common.array_shapes import PerSample, SampleValues
from posefield.common.units import Floats
from posefield_train.kriging import universal_kriging, variogram
from posefield_train.kriging.sample_points import SamplePoints
from posefield_train.kriging.universal_kriging import Hyper, LeaveOneOut
from posefield_train.kriging.variogram import ExperimentalVariogram

# Bounds of scales, per half-range of a control. The lower bound means "linear in this control"; in
# float32 samples would coincide beyond the bounds.
SCALE_BOUNDS = (0.15, 3.0)
# Bounds of the nugget, as a share of the sill. Repeated trials can differ by several sills.
NUGGET_BOUNDS = (1e-4, 10.0)
# Bounds of label distances: from similar performers to independent ones.
LABEL_BOUNDS = (0.05, 4.0)
DESCENT_COUNT = 2
SIMPLEX_STEP = 0.7
# Stopping criteria: size of the simplex in logarithms, relative difference of losses, evaluations.
SIMPLEX_TOLERANCE, EVEN, MOST = 1e-2, 1e-5, 400


@dataclass(frozen=True)
class TunedKriging:
    """A tuned kriging model.

    residuals: leave-one-out residuals (n, m). unexplained: their squared sum relative to that of
    the mean of the other samples; at one or above the controls explain nothing. variances: of the
    residuals (n,), as shares of the sill. sill: of the sum over values.
    """

    hyper: Hyper
    residuals: SampleValues
    unexplained: float
    variances: PerSample
    sill: float


def initial_guess(
    experimental: ExperimentalVariogram, controls: int, covariance: str, drifts: tuple[int, ...]
) -> Hyper:
    """Return parameters of the isotropic variogram fit, within the bounds.

    experimental: variogram of the residuals from the highest degree in `drifts`. controls:
    their number.
    """
    fit = variogram.fit_by_grid(experimental, covariance)
    share = fit.nugget / fit.sill if fit.sill > 0 else NUGGET_BOUNDS[1]
    scales = np.full(controls, np.clip(1.0 / fit.range, *SCALE_BOUNDS))
    return Hyper(covariance, drifts, scales, float(np.clip(share, *NUGGET_BOUNDS)), 0.0)


def evaluate_fixed(hyper: Hyper, samples: SamplePoints, values: SampleValues) -> TunedKriging:
    """Return the model of given parameters with its leave-one-out residuals."""
    left_out = universal_kriging.leave_out(hyper, samples.points, samples.groups)
    variances = universal_kriging.left_out_variances(hyper, samples.points, left_out)
    residuals, from_mean = left_out @ values, samples.from_mean(values)
    total = float(np.sum(np.square(from_mean)))
    return TunedKriging(
        hyper,
        residuals,
        float(np.sum(np.square(residuals))) / total if total > 0 else 1.0,
        variances,
        float(np.mean(np.sum(np.square(residuals), axis=1) / variances)),
    )


def tune(
    guess: Hyper, samples: SamplePoints, values: SampleValues, nugget: float | None
) -> TunedKriging:
    """Return the model with scales, label distance and nugget that minimize the squared residuals.

    values: (n, m), in a Euclidean metric. nugget: fixed value; None to tune it. Nelder and Mead's
    simplex starts from the best points of the guess and a coarse grid, because the loss has several
    minima, between a smooth model and one of independent samples.
    """
    d, labelled = samples.controls, samples.labelled
    bounds = [SCALE_BOUNDS] * d + [LABEL_BOUNDS] * labelled + [NUGGET_BOUNDS]
    low, high = np.log(bounds).T

    def read(x: Floats) -> Hyper:
        found = np.exp(x)
        return replace(
            guess,
            scales=found[:d],
            label=float(found[d]) if labelled else 0.0,
            nugget=float(found[-1]) if nugget is None else nugget,
        )

    # The residuals depend on the values only through their inner products.
    products = values @ values.T
    leave_one_out = LeaveOneOut(samples.points, samples.controls, samples.groups)

    def loss(x: Floats) -> float:
        left_out = leave_one_out.residual_matrix(read(x))
        return float(np.sum((left_out @ products) * left_out))

    starts = [np.clip(x, low, high) for x in _starts(guess, labelled)]
    best = min(_descend(loss, x, low, high) for x in sorted(starts, key=loss)[:DESCENT_COUNT])
    return evaluate_fixed(read(np.array(best[1])), samples, values)


def _starts(guess: Hyper, labelled: bool) -> list[Annotated[Floats, "parameters"]]:
    """Return logarithms of scales, label and nugget: the guess and an isotropic grid."""
    even = np.ones_like(guess.scales)
    pairs = [(guess.scales, guess.nugget)]
    pairs += [(s * even, n) for s in (0.2, 0.5, 1.2) for n in (0.02, 0.3, 2.0)]
    labels = ([0.5], [2.0]) if labelled else ([],)
    return [np.log([*scales, *label, nugget]) for scales, nugget in pairs for label in labels]


def _descend(
    loss: Callable[[Floats], float],
    start: Annotated[Floats, "parameters"],
    low: Annotated[Floats, "parameters"],
    high: Annotated[Floats, "parameters"],
) -> tuple[float, list[float]]:
    """Return the least loss found from a start within bounds, and its location."""
    # Steps of a factor of two: SciPy's default simplex is degenerate if a logarithm is near zero.
    inward = np.where(start + SIMPLEX_STEP > high, -SIMPLEX_STEP, SIMPLEX_STEP)
    simplex = np.vstack([start, start + np.diag(inward)])
    found = minimize(
        loss,
        start,
        method="Nelder-Mead",
        bounds=list(zip(low, high, strict=True)),
        options={
            "initial_simplex": simplex,
            "xatol": SIMPLEX_TOLERANCE,
            "fatol": EVEN * loss(start),
            "maxfev": MOST,
        },
    )
    return float(found.fun), [float(value) for value in found.x]
