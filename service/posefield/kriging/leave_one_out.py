"""Leave-one-out cross-validation of kriging, in closed form.

The residuals of all samples follow from the inverse of one system (Dubrule, "Cross validation of
kriging in a unique neighborhood", Mathematical Geology 1983, extended to blocks).
"""

from typing import Annotated

import numpy as np

from posefield.common.array_shapes import PerSample, SampleMatrix, Samples
from posefield.common.units import Floats, Indices
from posefield.kriging import kriging_model
from posefield.kriging.kriging_model import Hyper


def residual_matrix(
    inverse: SampleMatrix,
    functions: Annotated[Floats, "samples functions"],
    groups: Annotated[Indices, "samples"],
) -> SampleMatrix:
    """Return the matrix (n, n) from values to residuals for one drift.

    A residual is a sample's value minus its prediction from all other groups. inverse (n, n): of
    the covariances of measured samples. functions (n, k): the drift's. groups (n,): samples of one
    group, such as strides cut from one take, are left out together.
    """
    block = sample_block(inverse, functions)
    return divide_groups(block, block, equal_sized_groups(groups))


def sample_block(
    inverse: SampleMatrix, functions: Annotated[Floats, "samples functions"]
) -> SampleMatrix:
    """Return the sample block (n, n) of the inverse of the whole system [[C, F], [Fᵀ, 0]].

    inverse (n, n): of the covariances C. functions (n, k): the drift's, F.
    """
    weighed = inverse @ functions
    block: Floats = inverse - weighed @ np.linalg.solve(functions.T @ weighed, weighed.T)
    return block


def divide_groups(
    block: SampleMatrix,
    rows: Annotated[Floats, "samples _"],
    several: list[Annotated[Indices, "_ _"]],
) -> Annotated[Floats, "samples _"]:
    """Return rows (n, m), each group's multiplied by the inverse of its part of a block (n, n).

    several: of the groups of more than one sample, as `equal_sized_groups` returns them.
    """
    found: Floats = rows / np.diagonal(block)[:, None]
    for own in several:
        among = block[own[:, :, None], own[:, None, :]]
        found[own] = np.linalg.solve(among, rows[own])
    return found


def equal_sized_groups(
    groups: Annotated[Indices, "samples"],
) -> list[Annotated[Indices, "_ _"]]:
    """Return sample indices (g, size) of the groups (n,) of each size above one."""
    _, names, sizes = np.unique(groups, return_inverse=True, return_counts=True)
    order = np.argsort(names, kind="stable")
    several = np.unique(sizes[sizes > 1])
    return [order[sizes[names[order]] == size].reshape(-1, size) for size in several]


def leave_out(
    hyper: Hyper, samples: Samples, groups: Annotated[Indices, "samples"]
) -> SampleMatrix:
    """Return the matrix (n, n) from values to leave-one-out residuals of one field.

    samples (n, d + p): d controls in half-ranges and p weights of labels. With more than one drift,
    a residual is from the mean of the predictions.
    """
    d = len(hyper.scales)
    inverse: Floats = np.asarray(np.linalg.inv(kriging_model.noisy(hyper, samples)))
    found = [
        residual_matrix(inverse, kriging_model.drift(samples, d, degree), groups)
        for degree in hyper.drifts
    ]
    return np.asarray(sum(found[1:], found[0]) / len(found))


def left_out_variances(hyper: Hyper, samples: Samples, left_out: SampleMatrix) -> PerSample:
    """Return the variances (n,) of residuals by a matrix (n, n) of `leave_out`.

    They include the nugget and are shares of the sill.
    """
    return np.sum((left_out @ kriging_model.noisy(hyper, samples)) * left_out, axis=1)
