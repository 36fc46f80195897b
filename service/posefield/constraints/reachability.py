"""Reachability of constraints, measured by the residuals of captured motions.

For each captured clip, the leave-one-out prediction has an error in the constrained values; it is
smaller for a hand that controls place than for its elbow. Constraints at a larger distance are
approached up to the largest distance of captured motions.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np

from posefield.common import cancellation
from posefield.common.units import Booleans, Floats, Indices
from posefield.constraints.constrained_motion import ConstrainedMotion
from posefield.constraints.constraint import (
    Constraint,
    StackedGradients,
    StackedValues,
    StackedVariables,
)
from posefield.inference.reduced_motion import ResidualCovariance

# Weight in the covariance of an equal share for all values of a constraint, so that none has zero
# variance.
EQUAL_SHARE = 0.1
# Factor on the covariances between the equal shares of different constraints, such as those of one
# joint at successive moments.
SHARE_CORRELATION = 0.99
# Standard deviations that three coordinates of a target may be off: exceeded by one captured clip
# in 300. At 4, a tenth of the targets 20 cm too far are accepted; at 3.25, one captured clip in 70
# is not.
MAX_DEVIATIONS = 3.7
# Halvings of the interval of the price at which differences are within the largest distance.
HALVINGS = 40

CorrectionTask = tuple[ConstrainedMotion, Sequence[Constraint]]
"""A motion, predicted or varied, and the constraints that its correction satisfies."""
StackedMatrices = Annotated[Floats, "motions values values"]


@dataclass(frozen=True)
class Reachability:
    """Differences (M, k) between constraints and motions, with their covariances.

    differences: differences of the values from their targets. covariance: (M, k, k). members (k,
    aims): 1 where a value belongs to a constraint, else 0.
    """

    differences: StackedValues
    covariance: StackedMatrices
    members: Annotated[Floats, "values aims"]

    @cached_property
    def distance(self) -> Annotated[Floats, "motions"]:
        """Mahalanobis distances (M,) of the constraints."""
        solved = stacked_solve(self.covariance, self.differences)
        return np.asarray(np.sqrt(stacked_dot(self.differences, solved)))

    @cached_property
    def weights(self) -> StackedValues:
        """Weight (M, k) of each value in the squared error.

        The inverse mean variance of its constraint, so that metres and degrees compare.
        """
        sizes = self.members.sum(axis=0)
        variances = np.diagonal(self.covariance, axis1=1, axis2=2)
        means = (variances[:, None] @ self.members) / sizes
        return np.asarray(1.0 / (means @ self.members.T)[:, 0])

    @property
    def reachable(self) -> StackedValues:
        """Reachable parts (M, k) of the differences.

        All of them within the largest plausible distance; else a share of each constraint's
        difference, chosen for the least remaining error at that distance.
        """
        reachable = self.differences.copy()
        far = np.flatnonzero(self.distance > distance_limit(reachable.shape[1]))
        if len(far):
            reachable[far] = self._nearest(far)
        return reachable

    def _nearest(self, far: Annotated[Indices, "chosen"]) -> Annotated[Floats, "chosen values"]:
        """Return the reachable parts (m, k) of differences beyond the largest distance."""
        limit = distance_limit(self.differences.shape[1])
        differences = self.members * self.differences[far][:, :, None]
        across = differences.swapaxes(1, 2)
        products = across @ np.linalg.solve(self.covariance[far], differences)
        misses = (across**2 @ self.weights[far][..., None])[..., 0]
        # A constraint that is met already has a difference of zero.
        scale = 1.0 / np.sqrt(np.where(misses == 0.0, 1.0, misses))
        # In the eigenvectors, the systems of all prices are diagonal.
        values, vectors = np.linalg.eigh(scale[:, :, None] * products * scale[:, None])
        loads = ((scale * misses)[:, None] @ vectors)[:, 0]

        def shares(price: Annotated[Floats, "motions"]) -> StackedValues:
            """Return the shares (m, aims) for the least error plus `price` squared distances."""
            solved = loads / (1.0 + price[:, None] * values)
            free = scale * (vectors @ solved[..., None])[..., 0]
            return np.asarray(np.minimum(np.maximum(free, 0.0), 1.0))

        def is_too_far(price: Annotated[Floats, "motions"]) -> Booleans:
            rows = shares(price)[:, None]
            return np.asarray((rows @ products @ rows.swapaxes(1, 2))[:, 0, 0] > limit**2)

        low, high = np.zeros(len(far)), np.ones(len(far))
        while (outside := is_too_far(high)).any():
            low, high = np.where(outside, high, low), np.where(outside, 4.0 * high, high)
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            outside = is_too_far(middle)
            low, high = np.where(outside, middle, low), np.where(outside, high, middle)
        return np.asarray((differences @ shares(high)[..., None])[..., 0])


def assess(
    spread: ResidualCovariance,
    tasks: Sequence[CorrectionTask],
    numbers: StackedVariables,
    values: StackedValues,
    gradients: StackedGradients,
) -> Reachability:
    """Return the reachability of the constraints of tasks of one kind from motions (M, numbers).

    values, gradients: of the motions.
    """
    sizes = [len(aim.target) for aim in tasks[0][1]]
    members = np.repeat(np.eye(len(sizes)), sizes, axis=0)
    sigmas = np.array([motion.state.sigma for motion, _ in tasks])
    covariance = np.square(sigmas)[:, None, None] * _blend_equal_shares(
        _residual_covariances(spread, tasks, numbers, gradients), members
    )
    targets = np.stack([np.concatenate([aim.target for aim in aims]) for _, aims in tasks])
    return Reachability(targets - values, covariance, members)


def distance_limit(values: int) -> float:
    """Return the largest plausible Mahalanobis distance of a number of values.

    Its probability is that of FAR for three values, by the approximation of Wilson and Hilferty
    (1931).
    """
    spread = np.sqrt(2.0 / (9.0 * 3.0))
    share = ((MAX_DEVIATIONS**2 / 3.0) ** (1.0 / 3.0) - (1.0 - spread**2)) / spread
    deviation = np.sqrt(2.0 / (9.0 * values))
    return float(np.sqrt(values * (1.0 - deviation**2 + share * deviation) ** 3))


def _residual_covariances(
    spread: ResidualCovariance,
    tasks: Sequence[CorrectionTask],
    numbers: StackedVariables,
    gradients: StackedGradients,
) -> StackedMatrices:
    """Return the covariances (M, k, k) of leave-one-out residuals in the constrained values.

    For a sigma of one metre, with the skeletons and the travels of these motions.
    """
    motions = np.concatenate([spread.captured, spread.predicted])
    clips = len(spread.captured)
    strays = np.empty((len(tasks), clips, gradients.shape[1]))
    for index, (motion, aims) in enumerate(tasks):
        cancellation.check()
        values = np.hstack(
            [aim.evaluate_motions(motion.scene, numbers[index], motions) for aim in aims]
        )
        strays[index] = (values[:clips] - values[clips:]) / spread.sigmas[:, None]
    outer = gradients[:, :, motions.shape[1] :]
    inner_part = strays.swapaxes(1, 2) @ strays
    return np.asarray(inner_part + outer @ spread.cycle @ outer.swapaxes(1, 2))


def _blend_equal_shares(
    covariance: StackedMatrices, members: Annotated[Floats, "values aims"]
) -> StackedMatrices:
    """Return covariances (M, k, k) blended with equal shares for all values of a constraint.

    The shares correlate between constraints as their mean covariances do; otherwise two
    contradicting constraints would seem near.
    """
    sizes = members.sum(axis=0)
    axes = np.concatenate([np.arange(size) for size in sizes])
    sizes_of_values = members @ sizes
    alike = (axes[:, None] == axes) & (sizes_of_values[:, None] == sizes_of_values)
    shared = members.T @ (alike * covariance) @ members / sizes
    # A value that never varies has a variance of zero.
    variances = np.maximum(shared, 1e-12) * np.eye(len(sizes))
    shared = SHARE_CORRELATION * shared + (1.0 - SHARE_CORRELATION) * variances
    return (1.0 - EQUAL_SHARE) * covariance + EQUAL_SHARE * alike * (members @ shared @ members.T)


def stacked_solve(matrices: StackedMatrices, right: StackedValues) -> StackedValues:
    """Return the solutions (M, k) of systems, each by a factorisation of its own."""
    return np.asarray(np.linalg.solve(matrices, right[..., None])[..., 0])


def stacked_dot(a: StackedValues, b: StackedValues) -> Annotated[Floats, "motions"]:
    """Return the dot products (M,) of vectors (M, k), each by a product of its own."""
    return np.asarray((a[:, None] @ b[..., None])[:, 0, 0])
