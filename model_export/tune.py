"""Scales and nugget of a field by leave-one-out, in closed form."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from model_export import kriging, variogram
from model_export.kriging import Hyper
from model_export.samples import Samples
from service.motion.conventions import Floats

# In half-ranges of a control. A scale at the lower bound means "linear in this control"; beyond
# the bounds float32 would no longer tell the samples apart.
SCALES = (0.15, 3.0)
# As a share of the sill. Real trials differ so much that a nugget of several sills can be right.
NUGGETS = (1e-4, 10.0)
# From performers who move alike to performers who say nothing of each other.
LABELS = (0.05, 4.0)
DESCENTS = 2
STEP = 0.7
# A simplex this small in the logarithms, of losses this alike, is at its end.
CLOSE, EVEN, MOST = 1e-2, 1e-5, 400


@dataclass(frozen=True)
class Tuned:
    """A chosen field: residuals (n, m) of its leave-one-out, their share of the mean's, its sill.

    unexplained: squared residuals over those of leaving the controls out and taking the mean of
    the others; at one or above the controls explain nothing. variances (n,): of the residuals, as
    shares of the sill. sill: of the sum over values.
    """

    hyper: Hyper
    residuals: Floats
    unexplained: float
    variances: Floats
    sill: float


def first_guess(samples: Floats, values: Floats, covariance: str, drifts: tuple[int, ...]) -> Hyper:
    """Isotropic field from the fit of the experimental variogram, within the bounds.

    samples (n, d): the controls alone.
    """
    left = variogram.residuals(samples, values, max(drifts))
    fit = variogram.fit(variogram.experimental(samples, left), covariance)
    share = fit.nugget / fit.sill if fit.sill > 0 else NUGGETS[1]
    scales = np.full(samples.shape[1], np.clip(1.0 / fit.range, *SCALES))
    return Hyper(covariance, drifts, scales, float(np.clip(share, *NUGGETS)))


def fixed(hyper: Hyper, samples: Samples, values: Floats) -> Tuned:
    """Field of given parameters with its leave-one-out residuals."""
    left_out = kriging.leave_out(hyper, samples.points, samples.groups)
    variances = kriging.left_out_variances(hyper, samples.points, left_out)
    residuals, from_mean = left_out @ values, samples.from_mean(values)
    total = float(np.sum(np.square(from_mean)))
    return Tuned(
        hyper,
        residuals,
        float(np.sum(np.square(residuals))) / total if total > 0 else 1.0,
        variances,
        float(np.mean(np.sum(np.square(residuals), axis=1) / variances)),
    )


def tune(guess: Hyper, samples: Samples, values: Floats, nugget: float | None) -> Tuned:
    """Field with the scales, the label's distance where there is one, and the nugget where none
    is given, of least squared residuals.

    values (n, m) in a metric of their own. Nelder and Mead's simplex descends from the best of the
    guess and a coarse grid: there are ridges between a smooth field and one in which every sample
    stands alone.
    """
    d, labelled = samples.controls, samples.labelled
    bounds = [SCALES] * d + [LABELS] * labelled + [NUGGETS]
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

    def loss(x: Floats) -> float:
        left_out = kriging.leave_out(read(x), samples.points, samples.groups)
        return float(np.sum((left_out @ products) * left_out))

    starts = [np.clip(x, low, high) for x in _starts(guess, labelled)]
    best = min(_descend(loss, x, low, high) for x in sorted(starts, key=loss)[:DESCENTS])
    return fixed(read(np.array(best[1])), samples, values)


def _starts(guess: Hyper, labelled: bool) -> list[Floats]:
    """Logarithms of scales, label and nugget: the variogram's guess and an isotropic grid."""
    even = np.ones_like(guess.scales)
    pairs = [(guess.scales, guess.nugget)]
    pairs += [(s * even, n) for s in (0.2, 0.5, 1.2) for n in (0.02, 0.3, 2.0)]
    labels = ([0.5], [2.0]) if labelled else ([],)
    return [np.log([*scales, *label, nugget]) for scales, nugget in pairs for label in labels]


def _descend(
    loss: Callable[[Floats], float], start: Floats, low: Floats, high: Floats
) -> tuple[float, list[float]]:
    """Least loss found from a start within bounds, and where."""
    # Steps of a factor of about two: SciPy's own simplex would be a point where a logarithm is 0.
    inward = np.where(start + STEP > high, -STEP, STEP)
    simplex = np.vstack([start, start + np.diag(inward)])
    found = minimize(
        loss,
        start,
        method="Nelder-Mead",
        bounds=list(zip(low, high, strict=True)),
        options={
            "initial_simplex": simplex,
            "xatol": CLOSE,
            "fatol": EVEN * loss(start),
            "maxfev": MOST,
        },
    )
    return float(found.fun), [float(value) for value in found.x]
