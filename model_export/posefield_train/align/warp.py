"""Time warps with few parameters: monotone cubic B-splines from clip time to canonical time.

A warp s(u) maps [0, 1] onto itself. Its coefficients rise from 0 to 1, so it is monotone (variation
diminishing), and its acceleration is continuous, so it adds no jerk. The logarithms of its
increments relative to the identity are stored, averaged and predicted: any real values make a valid
warp, and zeros make the identity.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated

import numpy as np
from scipy.interpolate import BSpline
from scipy.optimize import lsq_linear

from posefield.common.units import ClipFrames, Floats, PerClip
from posefield.model_file.model_card import ROW_VALUES
from posefield_train.onnx_graph import GraphBuilder

DEGREE = 3
# Least increment as a share of the identity's, so that no pose is frozen.
MINIMUM_INCREMENT = 0.15
FIT_TIMES = np.linspace(0.0, 1.0, 501)
# After them the mean differs from the identity by what the knots cannot follow.
CORRECTION_ROUNDS = 3


@dataclass(frozen=True)
class WarpBasis:
    """Basis of warps. knots: number of free increments."""

    knots: int

    def __post_init__(self) -> None:
        if self.knots < DEGREE:
            raise ValueError(f"{self.knots} knots, expected at least {DEGREE}")

    @cached_property
    def breaks(self) -> Annotated[Floats, "breaks"]:
        """Return the interior ends of the polynomial pieces in (0, 1)."""
        return np.linspace(0.0, 1.0, self.knots - DEGREE + 2)[1:-1]

    @cached_property
    def _knot_vector(self) -> Annotated[Floats, "..."]:
        return np.concatenate([np.zeros(DEGREE + 1), self.breaks, np.ones(DEGREE + 1)])

    @cached_property
    def identity(self) -> Annotated[Floats, "{self.knots}"]:
        """Return increments (knots,) of the identity: differences of the Greville abscissae."""
        greville = [self._knot_vector[i + 1 : i + 1 + DEGREE].mean() for i in range(self.knots + 1)]
        return np.diff(greville)

    @cached_property
    def _dense_design(self) -> Annotated[Floats, "dense {self.knots}"]:
        return self.design(FIT_TIMES)

    def design(self, u: Annotated[Floats, "*asked"]) -> Annotated[Floats, "*asked {self.knots}"]:
        """Return basis values (..., knots) that multiply increments to give s(u)."""
        values = BSpline(self._knot_vector, np.eye(self.knots + 1), DEGREE)(u)
        return np.cumsum(values[..., ::-1], axis=-1)[..., ::-1][..., 1:]

    @cached_property
    def power_form(self) -> Annotated[Floats, "powers {self.knots}"]:
        """Return the matrix (2 + pieces, knots) of the basis over u, u² and (u - break)³₊.

        The first break is zero. The graph evaluates this form with products and a Relu.
        """
        u = np.linspace(0.0, 1.0, 64)
        coefficients, *_ = np.linalg.lstsq(self.powers(u), self.design(u), rcond=None)
        return np.asarray(coefficients, dtype=np.float64)

    def powers(self, u: Annotated[Floats, "*asked"]) -> Annotated[Floats, "*asked powers"]:
        """Return functions (..., 2 + pieces) of the power form at u (...)."""
        hinges = np.maximum(u[..., None] - np.concatenate([[0.0], self.breaks]), 0.0)
        return np.concatenate([np.stack([u, u * u], axis=-1), hinges**3], axis=-1)

    def increments(
        self, logs: Annotated[Floats, "*clips {self.knots}"]
    ) -> Annotated[Floats, "*clips {self.knots}"]:
        """Return increments (..., knots), with sum one, of log increments (..., knots)."""
        raw = self.identity * np.exp(logs - logs.max(axis=-1, keepdims=True))
        return raw / raw.sum(axis=-1, keepdims=True)

    def evaluate(
        self,
        logs: Annotated[Floats, "*#clips {self.knots}"],
        u: Annotated[Floats, "*#clips asked"],
    ) -> Annotated[Floats, "*clips asked"]:
        """Return canonical time s (..., S) at clip times u (..., S) in [0, 1].

        Leading axes broadcast: one row of times serves all warps.
        """
        # Training evaluates the times DENSE a thousand times.
        design = self._dense_design if u is FIT_TIMES else self.design(u)
        return np.einsum("...sk,...k->...s", design, self.increments(logs))

    def invert(
        self, logs: Annotated[Floats, "{self.knots}"], s: Annotated[Floats, "asked"]
    ) -> Annotated[Floats, "asked"]:
        """Return clip times u (S,) at which one warp reaches canonical times s (S,)."""
        return np.interp(s, self.evaluate(logs, FIT_TIMES), FIT_TIMES)

    def fit(
        self,
        s: Annotated[Floats, "dense"],
        weights: Annotated[Floats, "dense"],
        stiffness: float = 0.0,
    ) -> Annotated[Floats, "{self.knots}"]:
        """Return log increments (knots,) of the warp nearest to samples s (501,) at FIT_TIMES.

        Penalized least squares with a lower bound; the large weight of the last sample makes the
        increments sum to one. stiffness: miss of all samples, as a share of the clip, that costs as
        much as slopes that differ from the identity's by their whole.
        """
        worth = np.sqrt(weights)
        worth[-1] = 1e3
        bounds = (MINIMUM_INCREMENT * self.identity, np.ones(self.knots))
        penalty = np.full(self.knots, stiffness * np.sqrt(len(FIT_TIMES) / self.knots))
        rows = np.vstack([self._dense_design * worth[:, None], np.diag(penalty / self.identity)])
        fitted = lsq_linear(rows, np.concatenate([s * worth, penalty]), bounds, method="bvls")
        increments = fitted.x / fitted.x.sum()
        return np.log(increments / self.identity)


@dataclass(frozen=True)
class CanonicalTiming:
    """Canonical frames 0 to frames - 1, and the warps to them that are predicted.

    correction: log increments (knots,) that are added to predicted ones; None for none.
    """

    basis: WarpBasis
    frames: int
    correction: Annotated[Floats, "knots"] | None = None

    def unbiased(self, predicted: Annotated[Floats, "clips knots"]) -> "CanonicalTiming":
        """Return the timing with the correction for left-out predicted log increments (N, knots).

        The exponential of a mean is less than the mean of exponentials (Duan 1983, "Smearing
        estimate"), so predicted warps are steep where captured ones vary, which is at the ends.
        With the correction their mean inverse is the identity, as that of the captured warps is.
        """
        timing, even = self, np.ones(len(FIT_TIMES))
        for _ in range(CORRECTION_ROUNDS):
            corrected = timing.warps(predicted)
            inverse = np.mean([self.basis.invert(logs, FIT_TIMES) for logs in corrected], axis=0)
            timing = replace(self, correction=timing.warps(self.basis.fit(inverse, even)))
        return timing

    def warps(self, logs: Annotated[Floats, "*clips knots"]) -> Annotated[Floats, "*clips knots"]:
        """Return log increments (..., knots) of the warps that predicted ones (..., knots) mean."""
        return logs if self.correction is None else logs + self.correction

    def numpy(
        self,
        log_duration: Annotated[Floats, "clips 1"],
        logs: Annotated[Floats, "clips knots"],
        time: ClipFrames,
    ) -> tuple[PerClip, ClipFrames]:
        """Return durations (B,), s, and canonical frames (B, S) at times (B, S), s.

        log_duration: (B, 1). logs: (B, knots). Times outside the clip are clamped to its ends.
        """
        durations = np.exp(log_duration[:, 0])
        u = np.clip(time / durations[:, None], 0.0, 1.0)
        return durations, (self.frames - 1) * self.basis.evaluate(self.warps(logs), u)

    def onnx(self, net: GraphBuilder, log_duration: str, logs: str, time: str) -> tuple[str, str]:
        """Build durations (B, 1), s, and canonical frames (B, S)."""
        duration = net.rename_value(ROW_VALUES["duration"], net("Exp", log_duration))
        u = net("Clip", net("Div", time, duration), net.number(0.0), net.number(1.0))
        still = net.weights("warp_still", self.warps(np.log(self.basis.identity)))
        increments = net("Softmax", net("Add", logs, still), axis=1)
        # Scale to frames here, at no extra cost.
        form = net.weights("warp_form", (self.frames - 1) * self.basis.power_form)
        coefficients = net("Unsqueeze", net("Gemm", form, increments, transB=1), net.indices(2))
        # Powers lie outermost: a sum over them has the same order at every place of a row.
        terms = net("Mul", self._powers(net, u), coefficients)
        frames = net("ReduceSum", terms, net.indices(0), keepdims=0)
        return duration, net("Clip", frames, net.number(0.0), net.number(self.frames - 1.0))

    def _powers(self, net: GraphBuilder, u: str) -> str:
        """Build the functions (2 + pieces, B, S) of the warps' power form at shares (B, S).

        Each is a product of three factors: u times ones, u times u, or a hinge cubed.
        """
        breaks = np.concatenate([np.zeros(3), self.basis.breaks])[:, None, None]
        hinges = net("Sub", u, net.weights("warp_breaks", breaks))
        # No hinge exceeds one, and none of the first two is negative.
        lowest = np.zeros((2, len(breaks), 1, 1))
        lowest[0, :1], lowest[1, :2] = 1.0, 1.0
        second, third = (
            net("Max", hinges, net.weights(f"warp_factor_{i + 2}", lowest[i])) for i in range(2)
        )
        return net("Mul", net("Mul", net("Relu", hinges), second), third)
