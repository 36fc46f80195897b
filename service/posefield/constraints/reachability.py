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
from posefield.common.array_shapes import Gradients, ReducedMotions, ValueMatrix, Values, Variables
from posefield.common.units import Floats
from posefield.constraints.constraint import Constraint, ValuesAndGradients
from posefield.constraints.motion_variables import MotionVariables
from posefield.inference.residual_covariance import ResidualCovariance

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


@dataclass(frozen=True)
class Reachability:
    """Differences (k,) between constraints and a motion, with their covariance.

    differences: differences of the values from their targets. covariance: (k, k). members (k,
    aims): 1 where a value belongs to a constraint, else 0.
    """

    differences: Values
    covariance: ValueMatrix
    members: Annotated[Floats, "values aims"]

    @cached_property
    def distance(self) -> float:
        """Mahalanobis distance of the constraints."""
        return float(np.sqrt(self.differences @ np.linalg.solve(self.covariance, self.differences)))

    @cached_property
    def weights(self) -> Values:
        """Weight (k,) of each value in the squared error.

        The inverse mean variance of its constraint, so that metres and degrees compare.
        """
        return 1.0 / (self.members @ _means(self.members, np.diagonal(self.covariance)))

    @property
    def reachable(self) -> Values:
        """Reachable part (k,) of the differences.

        All of them within the largest plausible distance; else a share of each constraint's
        difference, chosen for the least remaining error at that distance.
        """
        limit = distance_limit(len(self.differences))
        if self.distance <= limit:
            return self.differences
        each = self.members * self.differences[:, None]
        apart = each.T @ np.linalg.solve(self.covariance, each)
        misses = np.diag(each.T**2 @ self.weights)
        low, high = 0.0, 1.0
        while _length(apart, _shares(apart, misses, high)) > limit:
            low, high = high, 4.0 * high
        for _ in range(40):
            middle = 0.5 * (low + high)
            outside = _length(apart, _shares(apart, misses, middle)) > limit
            low, high = (middle, high) if outside else (low, middle)
        return np.asarray(each @ _shares(apart, misses, high), np.float64)


def assess(
    scene: MotionVariables,
    spread: ResidualCovariance,
    sigma: float,
    numbers: Variables,
    aims: Sequence[Constraint],
    looked: ValuesAndGradients,
) -> Reachability:
    """Return the reachability of constraints from a motion (numbers,).

    sigma: standard deviation of the motion, m. looked: its values and gradients, those of `aims`
    first.
    """
    members = np.repeat(np.eye(len(aims)), [len(aim.target) for aim in aims], axis=0)
    values, gradients = (seen[: len(members)] for seen in looked)
    covariance = sigma**2 * _blend_equal_shares(
        _residual_covariance(scene, spread, numbers, aims, gradients), members
    )
    return Reachability(np.concatenate([aim.target for aim in aims]) - values, covariance, members)


def distance_limit(values: int) -> float:
    """Return the largest plausible Mahalanobis distance of a number of values.

    Its probability is that of FAR for three values, by the approximation of Wilson and Hilferty
    (1931).
    """
    spread = np.sqrt(2.0 / (9.0 * 3.0))
    share = ((MAX_DEVIATIONS**2 / 3.0) ** (1.0 / 3.0) - (1.0 - spread**2)) / spread
    own = np.sqrt(2.0 / (9.0 * values))
    return float(np.sqrt(values * (1.0 - own**2 + share * own) ** 3))


def _residual_covariance(
    scene: MotionVariables,
    spread: ResidualCovariance,
    numbers: Variables,
    aims: Sequence[Constraint],
    gradients: Gradients,
) -> ValueMatrix:
    """Return the covariance (k, k) of leave-one-out residuals in the constrained values.

    For a sigma of one metre, with the skeleton and the travel of this motion.
    """
    motions = np.concatenate([spread.captured, spread.predicted])
    found = np.hstack([_evaluate_motions(aim, scene, numbers, motions) for aim in aims])
    clips = len(spread.captured)
    strays = (found[:clips] - found[clips:]) / spread.sigmas[:, None]
    beside = gradients[:, motions.shape[1] :]
    return np.asarray(strays.T @ strays + beside @ spread.beside @ beside.T, np.float64)


def _evaluate_motions(
    aim: Constraint,
    scene: MotionVariables,
    numbers: Variables,
    motions: ReducedMotions,
) -> Annotated[Floats, "motions values"]:
    cancellation.check()
    return aim.evaluate_motions(scene, numbers, motions)


def _blend_equal_shares(
    covariance: ValueMatrix, members: Annotated[Floats, "values aims"]
) -> ValueMatrix:
    """Return the covariance blended with equal shares for all values of a constraint.

    The shares correlate between constraints as their mean covariances do; otherwise two
    contradicting constraints would seem near.
    """
    sizes = members.sum(axis=0)
    place = np.concatenate([np.arange(size) for size in sizes])
    beside = members @ sizes
    alike = (place[:, None] == place) & (beside[:, None] == beside)
    shared = members.T @ (alike * covariance) @ members / sizes
    # A value that never varies has a variance of zero.
    own = np.diag(np.maximum(np.diagonal(shared), 1e-12))
    shared = SHARE_CORRELATION * shared + (1.0 - SHARE_CORRELATION) * own
    return (1.0 - EQUAL_SHARE) * covariance + EQUAL_SHARE * alike * (members @ shared @ members.T)


def _means(members: Annotated[Floats, "values aims"], values: Values) -> Annotated[Floats, "aims"]:
    return np.asarray(members.T @ values / members.sum(axis=0), np.float64)


def _shares(
    apart: Annotated[Floats, "aims aims"], misses: Annotated[Floats, "aims aims"], price: float
) -> Annotated[Floats, "aims"]:
    """Return the shares (aims,) of the differences for the least error plus weighted distance.

    price: weight of the squared distance.
    """
    # A constraint that is met already has a difference of zero.
    met = np.diag((np.diagonal(misses) == 0.0).astype(float))
    found = np.linalg.solve(price * apart + misses + met, np.diagonal(misses))
    return np.asarray(np.clip(found, 0.0, 1.0), np.float64)


def _length(apart: Annotated[Floats, "aims aims"], shares: Annotated[Floats, "aims"]) -> float:
    return float(np.sqrt(shares @ apart @ shares))
