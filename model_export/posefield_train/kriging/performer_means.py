"""Shrinkage of predictions toward the mean motion of each performer.

Kriging is linear in the values of its samples. A prediction is therefore shrunk by samples that are
moved toward the mean of all samples with the same names; graph, takes and adaptation stay as they
are. Left-out recordings advise how far.
"""

from dataclasses import replace
from typing import Annotated

import numpy as np

from posefield.common.units import Floats, SampleMatrix, SampleValues
from posefield_train.kriging import universal_kriging
from posefield_train.kriging.kriging_tuning import TunedKriging
from posefield_train.kriging.sample_points import SamplePoints

NEGLIGIBLE = 0.05
"""Share of the means below which samples are not moved."""


def averaging(samples: SamplePoints, used: Annotated[Floats, "samples"]) -> SampleMatrix:
    """Return the matrix (n, n) from values to the mean of those used with the same names.

    used: (n,), one or zero. Where none has the same names, it is the mean of all that are used.
    """
    _, names = np.unique(samples.points[:, samples.controls :], axis=0, return_inverse=True)
    same = np.where(np.ravel(names)[:, None] == np.ravel(names), used, 0.0)
    same[~same.any(axis=1)] = used
    return same / same.sum(axis=1, keepdims=True)


def move(samples: SamplePoints, share: float, values: SampleValues) -> SampleValues:
    """Return sample values (n, m) moved by a share of the way to the means of their performers."""
    if share == 0.0:
        return values
    return values + share * (averaging(samples, np.ones(len(values))) @ values - values)


def leave_out(tuned: TunedKriging, samples: SamplePoints) -> SampleMatrix:
    """Return the matrix (n, n) from values to leave-one-group-out residuals of a shrunk model."""
    residuals = universal_kriging.leave_out_samples(tuned.hyper, samples)
    if tuned.share == 0.0:
        return residuals
    return residuals + tuned.share * _shifts(samples, residuals)


def _shifts(samples: SamplePoints, residuals: SampleMatrix) -> SampleMatrix:
    """Return the matrix (n, n) by which residuals grow from no shrinkage to the means alone.

    residuals: matrix (n, n) of the model without shrinkage. The means, too, are of other groups.
    """
    shifts = np.empty_like(residuals)
    for group in np.unique(samples.groups):
        rows = np.flatnonzero(samples.groups == group)
        means = averaging(samples, np.where(samples.groups == group, 0.0, 1.0))
        left = residuals[rows]
        shifts[rows] = np.eye(len(means))[rows] - means[rows] - left + left @ means
    return shifts


def shrink(
    tuned: TunedKriging,
    samples: SamplePoints,
    values: SampleValues,
    effector: Annotated[Floats, "samples _ _"] | None,
) -> TunedKriging:
    """Return a model of values (n, m) with the share of its performers' means that fits best.

    effector: as in `TuningProblem`; the event's joint counts as it does there. Families without
    names, and those of inducing clips, are not shrunk.
    """
    if not samples.labels or samples.inducing is not None:
        return tuned
    shift = _shifts(samples, universal_kriging.leave_out_samples(tuned.hyper, samples)) @ values
    pairs = [(tuned.residuals, shift)]
    if effector is not None:
        first = effector.shape[2]
        moved = (np.einsum("nkm,nm->nk", effector, one[:, :first]) for one in pairs[0])
        pairs.append(tuple(moved))
    total = sum(float(np.sum(np.square(change))) for _, change in pairs)
    gain = -sum(float(np.sum(left * change)) for left, change in pairs)
    share = min(gain / total, 1.0) if total > 0.0 else 0.0
    if share < NEGLIGIBLE:
        return tuned
    residuals = tuned.residuals + share * shift
    squares = np.sum(np.square(residuals), axis=1)
    unshrunk = float(np.sum(np.square(tuned.residuals)))
    return replace(
        tuned,
        share=share,
        residuals=residuals,
        unexplained=tuned.unexplained * float(np.sum(squares)) / unshrunk,
        sill=float(np.mean(squares / tuned.variances)),
    )
