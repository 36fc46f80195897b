"""Leave-one-out cross-validation of kriging, in closed form.

The residuals of all samples follow from the inverse of one system (Dubrule, "Cross validation of
kriging in a unique neighborhood", Mathematical Geology 1983, extended to blocks).
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import PerSample, SampleMatrix, Samples
from posefield.common.units import Floats, Indices
from posefield.kriging import kriging_model
from posefield.kriging.covariance import COVARIANCE_MODELS
from posefield.kriging.kriging_model import Hyper


@dataclass(frozen=True)
class LeaveOneOut:
    """Leave-one-out of fields of any parameters over the same samples.

    Distances per control, drift functions and groups do not depend on a field's parameters and are
    computed once: the search for scales and nugget calls `residual_matrix` several hundred times.

    samples (n, d + p): d controls in half-ranges and p performer labels. controls: d. groups (n,):
    samples of one group, such as strides cut from one take, are left out together.
    """

    samples: Samples
    controls: int
    groups: Annotated[Indices, "samples"]

    def residual_matrix(self, hyper: Hyper) -> SampleMatrix:
        """Return the matrix (n, n) from values to residuals.

        A residual is a sample's value minus its prediction from all other groups; with more than
        one drift, from the mean of the predictions.
        """
        inverse: Floats = np.asarray(np.linalg.inv(self._noisy(hyper)), dtype=np.float64)
        residuals = {degree: self._residuals(inverse, degree) for degree in set(hyper.drifts)}
        first, *others = hyper.drifts
        total = residuals[first].copy()
        for degree in others:
            total += residuals[degree]
        total /= len(hyper.drifts)
        return total

    def _noisy(self, hyper: Hyper) -> SampleMatrix:
        """Return the covariance (n, n) of measured samples: the field's, plus the nugget."""
        gaps = self._gaps * hyper.scales[:, None, None]
        squared = np.sum(np.square(gaps, out=gaps), axis=0)
        if hyper.label:
            squared += hyper.label**2 * self._others
        covariance = COVARIANCE_MODELS[hyper.covariance](squared)
        covariance.flat[:: len(covariance) + 1] += hyper.nugget
        return covariance

    @cached_property
    def _gaps(self) -> Annotated[Floats, "controls samples samples"]:
        """Return the differences (d, n, n), one plane per control as in `squared_distances`."""
        planes = self.samples.T[: self.controls]
        return np.subtract(planes[:, :, None], planes[:, None, :], order="C")

    @cached_property
    def _others(self) -> SampleMatrix:
        """Return the matrix (n, n): one where two samples have different performers, else zero."""
        labels = self.samples[:, self.controls :]
        return 1.0 - labels @ labels.T

    @cached_property
    def _drifts(self) -> dict[int, Annotated[Floats, "samples functions"]]:
        """Return the drift functions (n, k) of each degree."""
        return {
            degree: kriging_model.drift(self.samples, self.controls, degree) for degree in (0, 1)
        }

    @cached_property
    def _blocks(self) -> list[Annotated[Indices, "groups size"]]:
        """Return sample indices (groups, size) of the groups of each size above one."""
        _, names, sizes = np.unique(self.groups, return_inverse=True, return_counts=True)
        order = np.argsort(names, kind="stable")
        several = np.unique(sizes[sizes > 1])
        return [order[sizes[names[order]] == size].reshape(-1, size) for size in several]

    def _residuals(self, inverse: SampleMatrix, degree: int) -> SampleMatrix:
        """Return the matrix (n, n) for a drift of one degree.

        inverse (n, n): of the covariances alone; it serves the drifts of all degrees.
        """
        functions = self._drifts[degree]
        weighed = inverse @ functions
        # The sample block of the inverse of the whole system [[C, F], [Fᵀ, 0]].
        block = inverse - weighed @ np.linalg.solve(functions.T @ weighed, weighed.T)
        residuals = block / np.diagonal(block)[:, None]
        for own in self._blocks:
            among = block[own[:, :, None], own[:, None, :]]
            residuals[own] = np.linalg.solve(among, block[own])
        return residuals


def leave_out(
    hyper: Hyper, samples: Samples, groups: Annotated[Indices, "samples"]
) -> SampleMatrix:
    """Return the matrix (n, n) from values to leave-one-out residuals of one field.

    samples (n, d + p) and groups (n,) as for `LeaveOneOut`.
    """
    return LeaveOneOut(samples, len(hyper.scales), groups).residual_matrix(hyper)


def left_out_variances(hyper: Hyper, samples: Samples, left_out: SampleMatrix) -> PerSample:
    """Return the variances (n,) of residuals by a matrix (n, n) of `leave_out`.

    They include the nugget and are shares of the sill.
    """
    return np.sum((left_out @ kriging_model.noisy(hyper, samples)) * left_out, axis=1)
