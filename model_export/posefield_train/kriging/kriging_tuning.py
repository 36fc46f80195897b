"""Tuning of a kriging model's parameters by closed-form leave-one-out, with a prior on them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from posefield.common.units import Floats, PerSample, SampleValues
from posefield.kriging import kriging_model
from posefield.kriging.kriging_model import Hyper, LabelKernel
from posefield_train.jobs import Jobs, SerialJobs, ordered_results
from posefield_train.kriging import sample_points, universal_kriging
from posefield_train.kriging.sample_points import SamplePoints
from posefield_train.kriging.tuning_loss import (
    PRIORS,
    LeaveOneOutLoss,
    Parameter,
    PredictiveDensityLoss,
    TuningProblem,
)

# The loss has several minima, between a smooth field and one of independent samples.
STARTS = ((0.5, 0.1), (0.25, 0.03), (1.0, 0.3))
"""Scale and nugget at which searches start."""
ITERATIONS = 80
SERIAL = SerialJobs()
# Columns of the values of large families that are summed up at once.
COLUMNS_TOGETHER = 1_000


@dataclass(frozen=True)
class TunedKriging:
    """A tuned kriging model.

    residuals: leave-one-out residuals (n, m). unexplained: their squared sum relative to that of
    the mean of the other samples; at one or above the controls explain nothing. variances: of the
    residuals (n,), as shares of the sill. sill: of the sum over values. disagreement: between
    parameters tuned on two draws of a large family, the relative difference of their leave-one-out
    errors over all clips; None for one. share: of the way to the means of performers by which the
    samples are moved (`performer_means`).
    """

    hyper: Hyper
    residuals: SampleValues
    unexplained: float
    variances: PerSample
    sill: float
    disagreement: float | None = None
    share: float = 0.0


def evaluate_fixed(hyper: Hyper, samples: SamplePoints, values: SampleValues) -> TunedKriging:
    """Return the model of given parameters with its leave-one-out residuals."""
    left_out = universal_kriging.leave_out_samples(hyper, samples)
    variances = kriging_model.left_out_variances(hyper, samples.points, left_out)
    residuals, total = left_out @ values, _total(samples, values)
    if len(values) <= sample_points.LARGEST_DENSE:
        squares = np.sum(np.square(residuals), axis=1)
        residual_sum = float(np.sum(np.square(residuals)))
    else:
        # A square of each residual would take as much memory as the motions.
        squares = np.einsum("nm,nm->n", residuals, residuals)
        residual_sum = float(np.sum(squares))
    return TunedKriging(
        hyper,
        residuals,
        residual_sum / total if total > 0 else 1.0,
        variances,
        float(np.mean(squares / variances)),
    )


def _total(samples: SamplePoints, values: SampleValues) -> float:
    """Return the squared sum of the differences of values (n, m) from the mean of all others."""
    width = values.shape[1]
    # Whole motions of many clips are gigabytes in some copies.
    step = width if len(values) <= sample_points.LARGEST_DENSE else COLUMNS_TOGETHER
    return sum(
        float(np.sum(np.square(samples.from_mean(values[:, start : start + step]))))
        for start in range(0, width, step)
    )


def tune(
    problem: TuningProblem,
    covariance: str,
    degree: int | None,
    draw: int = 0,
    jobs: Jobs = SERIAL,
    loss: type[LeaveOneOutLoss] = LeaveOneOutLoss,
) -> TunedKriging:
    """Return the model whose parameters minimize a loss.

    degree: of the drift; None for a constant and a trend within the covariance. draw: of the clips
    of a large family, 0 or 1. jobs: executor of the searches from several starts.
    """
    labels = tuple(LabelKernel(count, 1.0, 0.0) for count in problem.samples.labels)
    scales = np.ones(problem.samples.controls)
    hyper = Hyper(covariance, (degree or 0,), scales, 0.0, 0.0, labels)
    names = _free(problem, trend=degree is None)
    starts = [(np.log(scale), np.log(nugget)) for scale, nugget in STARTS]
    drawn = loss(problem.drawn(draw), hyper, names, own_scales=True)
    return _best(drawn, [drawn.start(scale, nugget) for scale, nugget in starts], problem, jobs)


def tune_beside(problem: TuningProblem, pose: Hyper) -> TunedKriging:
    """Return a model with the scales and correlation of the pose's, and others tuned by density."""
    trend = pose.drifts == (0,) and pose.trend > 0.0
    return tune_at_scales(problem, replace(pose, trend=0.0), trend, PredictiveDensityLoss)


def tune_at_scales(
    problem: TuningProblem,
    hyper: Hyper,
    trend: bool = False,
    loss: type[LeaveOneOutLoss] = LeaveOneOutLoss,
) -> TunedKriging:
    """Return a model with the scales and correlation of `hyper`; trend: whether it is tuned too."""
    names = tuple(
        with_nugget for with_nugget in _free(problem, trend) if with_nugget[0] != "correlation"
    )
    with_nugget = loss(problem.drawn(0), hyper.without_offsets(), names, own_scales=False)
    starts = [with_nugget.start(0.0, np.log(nugget)) for _, nugget in STARTS]
    return _best(with_nugget, starts, problem, SERIAL)


def _free(problem: TuningProblem, trend: bool) -> tuple[Parameter, ...]:
    """Return the parameters besides the scales that a problem leaves open."""
    sets = len(problem.samples.labels)
    counts = {"correlation": sets, "offset": sets}
    counts |= {"trend": int(trend), "nugget": int(problem.nugget is None)}
    return tuple((name, index) for name in PRIORS for index in range(counts[name]))


def _best(
    loss: LeaveOneOutLoss, starts: Sequence[Floats], problem: TuningProblem, jobs: Jobs
) -> TunedKriging:
    """Return the model at the least loss that searches from the starts find.

    problem: the one that the loss is of, or of some of whose clips it is.
    """
    if not len(starts[0]):
        return evaluate_fixed(loss.read(starts[0]), problem.samples, problem.values)
    results = ordered_results(jobs, _search, ((start,) for start in starts), (loss,))
    _, best = min(results, key=lambda result: result[0])
    return evaluate_fixed(loss.read(best), problem.samples, problem.values)


def _search(loss: LeaveOneOutLoss, start: Floats) -> tuple[float, Floats]:
    """Return the least loss that a search from a start finds, and where."""
    result = minimize(
        loss.value_and_slope,
        start,
        jac=True,
        method="L-BFGS-B",
        bounds=[(prior.low, prior.high) for prior in loss.priors],
        options={"maxiter": ITERATIONS},
    )
    return float(result.fun), result.x
