"""Kriging of the samples of a family: dense, or projected onto inducing clips where they are many.

A projected model is stored as a dense one of its inducing clips, with the values that give its
weights: the graph, the card and all their readers have m clips in place of n (decision 0064).
"""

from typing import Annotated

import numpy as np

from posefield.common.array_shapes import SampleMatrix, SampleValues
from posefield.common.units import Indices
from posefield.kriging import kriging_model
from posefield_train.kriging import universal_kriging
from posefield_train.kriging.projected.projected_kriging import ProjectedProcess
from posefield_train.kriging.sample_points import SamplePoints
from posefield_train.kriging.universal_kriging import Hyper, UniversalKriging


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
