"""Durations as products of powers of the controls, times a kriged factor.

Where the controls fix the duration, as stride length and speed do, its logarithm is linear in
theirs. Kriging over the controls themselves would only approximate that.
"""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import PerControl, PointControls, SampleControls
from posefield.common.units import Floats
from posefield.kriging import kriging_model, leave_one_out
from posefield_train.kriging.sample_points import SamplePoints
from posefield_train.kriging.universal_kriging import Hyper
from posefield_train.onnx_graph.graph_builder import REGISTER, GraphBuilder

# Controls over a smaller ratio are nearly linear in their logarithms.
SMALLEST_RATIO = 1.3
NUGGETS = (0.01, 0.1, 1.0, 10.0)
# The powers are taken where they leave less than this share of the squared residuals.
CLEAR_SHARE = 0.5


@dataclass(frozen=True)
class PowerLaw:
    """Exponents (d,) of the controls, zero for controls without; floor (d,) of their values."""

    exponents: PerControl
    floor: PerControl

    def logarithms(self, controls: PointControls) -> Annotated[Floats, "points 1"]:
        """Return the logarithm (B, 1) of the product at controls (B, d) in their own units."""
        used = self.exponents != 0.0
        powers = np.log(np.maximum(controls[:, used], self.floor[used]))
        return np.asarray(powers @ self.exponents[used])[:, None]

    def onnx(self, net: GraphBuilder, controls: str) -> str:
        """Build `logarithms` in a graph.

        Each row is widened to whole registers by a product with ones and zeros, which is exact: the
        last numbers of a partly filled register round differently in a logarithm.
        """
        count = len(self.exponents)
        width = -(-count // REGISTER) * REGISTER
        wide = net("MatMul", controls, net.weights("duration_places", np.eye(count, width)))
        # Controls without exponent may be negative: one replaces them, whose logarithm is zero.
        floor = np.append(self.floor, np.ones(width - count))
        above = net("Max", wide, net.weights("duration_floor", floor))
        exponents = np.append(self.exponents, np.zeros(width - count))
        pairs = np.stack([exponents, exponents], axis=1)
        return net.row_sums(net("Log", above), net.weights("duration_exponents", pairs))


@dataclass(frozen=True)
class PowerLawFit:
    """A power law, the kriging parameters of what it leaves, and leave-one-out residuals (N, 1)."""

    law: PowerLaw
    hyper: Hyper
    residuals: Annotated[Floats, "samples 1"]


def fit_power_law(
    pose: Hyper,
    samples: SamplePoints,
    controls: SampleControls,
    logs: Annotated[Floats, "samples 1"],
    residuals: Annotated[Floats, "samples 1"],
) -> PowerLawFit | None:
    """Return the power law of logarithms (N, 1) of durations, or None if it is not clearly better.

    pose: model whose scales and correlation it shares. controls: (N, d), in their own units.
    residuals: leave-one-out residuals (N, 1) of a model without powers.
    """
    low, high = controls.min(axis=0), controls.max(axis=0)
    used = (low > 0.0) & (high > SMALLEST_RATIO * np.maximum(low, 0.0))
    if not used.any():
        return None
    functions = np.hstack([np.ones((len(controls), 1)), np.log(controls[:, used])])
    if kriging_model.find_required_group(samples.groups, functions) is not None:
        return None
    fits = []
    for nugget in NUGGETS:
        hyper = replace(pose.without_offsets(), drifts=(0,), nugget=nugget, trend=0.0)
        inverse: Floats = np.asarray(
            np.linalg.inv(kriging_model.noisy(hyper, samples.points)), dtype=np.float64
        )
        left_out = leave_one_out.residual_matrix(inverse, functions, samples.groups) @ logs
        weighed = inverse @ functions
        slopes = np.linalg.solve(functions.T @ weighed, weighed.T @ logs)[1:, 0]
        fits.append((float(np.sum(np.square(left_out))), hyper, slopes, left_out))
    squares, hyper, slopes, left_out = min(fits, key=lambda fit: fit[0])
    if squares >= CLEAR_SHARE * float(np.sum(np.square(residuals))):
        return None
    exponents, floor = np.zeros(len(low)), np.ones(len(low))
    exponents[used], floor[used] = slopes, 0.5 * low[used]
    return PowerLawFit(PowerLaw(exponents, floor), hyper, left_out)
