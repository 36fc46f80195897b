"""Covariances of unit sill and unit range, in ONNX and in NumPy.

Each takes the squared distance. The variogram is one minus the covariance.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from posefield.common.units import Floats
from posefield.kriging.kriging_model import COVARIANCE_MODELS, KERNEL_GAINS, RATE32, RATE52
from posefield_train.onnx_graph.graph_builder import GraphBuilder


@dataclass(frozen=True)
class Covariance:
    """A covariance of squared distances: a NumPy function, its slope, and a builder of ONNX nodes.

    slope: derivative by the squared distance; zero at distance zero where it is infinite there.
    gain: number by which the nodes expect squared distances to be multiplied, which saves a node.
    Rounding can give a squared distance of zero the other sign, and its square root would be NaN:
    the nodes take it for zero.
    """

    numpy: Callable[[Floats], Floats]
    slope: Callable[[Floats], Floats]
    onnx: Callable[[GraphBuilder, str], str]
    gain: float


def _exponential_onnx(net: GraphBuilder, scaled: str) -> str:
    return net("Exp", net("Neg", net("Sqrt", net("Relu", scaled))))


def _gaussian_onnx(net: GraphBuilder, scaled: str) -> str:
    return net("Exp", net("Min", scaled, net.number(0.0)))


def _spherical_onnx(net: GraphBuilder, scaled: str) -> str:
    h = net("Min", net("Sqrt", net("Relu", scaled)), net.number(1.0))
    cubed = net("Mul", net("Mul", h, h), h)
    falling = net("Sub", net("Mul", cubed, net.number(0.5)), net("Mul", h, net.number(1.5)))
    return net("Add", falling, net.number(1.0))


def _matern32_onnx(net: GraphBuilder, scaled: str) -> str:
    a = net("Sqrt", net("Relu", scaled))
    return net("Div", net("Add", a, net.number(1.0)), net("Exp", a))


def _matern52_onnx(net: GraphBuilder, scaled: str) -> str:
    squared = net("Relu", scaled)
    a = net("Sqrt", squared)
    linear = net("Add", a, net.number(1.0))
    growing = net("Add", net("Mul", squared, net.number(1.0 / 3.0)), linear)
    return net("Div", growing, net("Exp", a))


def _exponential_slope(squared: Floats) -> Floats:
    h = np.sqrt(squared)
    with np.errstate(divide="ignore"):
        return np.where(h > 0.0, -1.5 * np.exp(-3.0 * h) / h, 0.0)


def _gaussian_slope(squared: Floats) -> Floats:
    return -3.0 * np.exp(-3.0 * squared)


def _spherical_slope(squared: Floats) -> Floats:
    h = np.sqrt(squared)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where((h > 0.0) & (h < 1.0), 0.75 * (h - 1.0 / h), 0.0)


def _matern32_slope(squared: Floats) -> Floats:
    return -0.5 * RATE32**2 * np.exp(-RATE32 * np.sqrt(squared))


def _matern52_slope(squared: Floats) -> Floats:
    a = RATE52 * np.sqrt(squared)
    return -(RATE52**2) / 6.0 * (1.0 + a) * np.exp(-a)


_GRAPHS = {
    "exponential": (_exponential_slope, _exponential_onnx, KERNEL_GAINS["exponential"]),
    # The nodes of a Gaussian take negative squares, which saves a negation.
    "gaussian": (_gaussian_slope, _gaussian_onnx, -KERNEL_GAINS["gaussian"]),
    "spherical": (_spherical_slope, _spherical_onnx, KERNEL_GAINS["spherical"]),
    "matern32": (_matern32_slope, _matern32_onnx, KERNEL_GAINS["matern32"]),
    "matern52": (_matern52_slope, _matern52_onnx, KERNEL_GAINS["matern52"]),
}
COVARIANCES = {
    name: Covariance(formula, *_GRAPHS[name]) for name, formula in COVARIANCE_MODELS.items()
}
