"""Time warps of a few knots: monotone cubic B-splines from clip time to canonical time.

A warp s(u) maps [0, 1] onto itself. Its coefficients rise from 0 to 1, so it cannot run backwards
(variation diminishing), and it has continuous acceleration, so it adds no jerk. What is stored,
averaged and predicted are the logarithms of its increments against those of the identity: any
numbers at all make a valid warp, and zeros make none.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import BSpline
from scipy.optimize import lsq_linear

from service.motion.conventions import Floats

DEGREE = 3
# An increment never falls below this share of the identity's, so that no pose is frozen.
FLOOR = 0.15
DENSE = np.linspace(0.0, 1.0, 501)


@dataclass(frozen=True)
class WarpBasis:
    """Warps of `knots` free increments."""

    knots: int

    def __post_init__(self) -> None:
        if self.knots < DEGREE:
            raise ValueError(f"{self.knots} knots, expected at least {DEGREE}")

    @cached_property
    def breaks(self) -> Floats:
        """Ends of the polynomial pieces within (0, 1)."""
        return np.linspace(0.0, 1.0, self.knots - DEGREE + 2)[1:-1]

    @cached_property
    def _vector(self) -> Floats:
        return np.concatenate([np.zeros(DEGREE + 1), self.breaks, np.ones(DEGREE + 1)])

    @cached_property
    def still(self) -> Floats:
        """Increments (knots,) of the identity: gaps between the Greville abscissae."""
        greville = [self._vector[i + 1 : i + 1 + DEGREE].mean() for i in range(self.knots + 1)]
        return np.diff(greville)

    def design(self, u: Floats) -> Floats:
        """Basis values (..., knots) by which increments are multiplied to give s(u)."""
        values = BSpline(self._vector, np.eye(self.knots + 1), DEGREE)(u)
        return np.cumsum(values[..., ::-1], axis=-1)[..., ::-1][..., 1:]

    @cached_property
    def power_form(self) -> Floats:
        """Matrix (2 + pieces, knots) of the same basis over u, u² and (u - break)³₊.

        The first break is zero. This is the form the graph evaluates: products and a Relu.
        """
        u = np.linspace(0.0, 1.0, 64)
        coefficients, *_ = np.linalg.lstsq(self.powers(u), self.design(u), rcond=None)
        return np.asarray(coefficients, dtype=np.float64)

    def powers(self, u: Floats) -> Floats:
        """Functions (..., 2 + pieces) of the power form at u (...)."""
        hinges = np.maximum(u[..., None] - np.concatenate([[0.0], self.breaks]), 0.0)
        return np.concatenate([np.stack([u, u * u], axis=-1), hinges**3], axis=-1)

    def increments(self, logs: Floats) -> Floats:
        """Increments (..., knots), adding up to one, of log increments (..., knots)."""
        raw = self.still * np.exp(logs - logs.max(axis=-1, keepdims=True))
        return raw / raw.sum(axis=-1, keepdims=True)

    def evaluate(self, logs: Floats, u: Floats) -> Floats:
        """Canonical time s (..., S) at clip times u (..., S) in [0, 1]."""
        return np.einsum("...sk,...k->...s", self.design(u), self.increments(logs))

    def invert(self, logs: Floats, s: Floats) -> Floats:
        """Clip times u (S,) at which one warp reaches canonical times s (S,)."""
        return np.interp(s, self.evaluate(logs, DENSE), DENSE)

    def fit(self, s: Floats, weights: Floats) -> Floats:
        """Log increments (knots,) of the warp nearest to samples s (501,) at the times DENSE.

        Least squares under the floor; the increments add up to one because the last sample is
        worth more than all the others together.
        """
        worth = np.sqrt(weights)
        worth[-1] = 1e3
        bounds = (FLOOR * self.still, np.ones(self.knots))
        fitted = lsq_linear(self.design(DENSE) * worth[:, None], s * worth, bounds, method="bvls")
        increments = fitted.x / fitted.x.sum()
        return np.log(increments / self.still)
