"""Covariances of unit sill and unit range, in ONNX and in NumPy.

Each takes the squared distance. The variogram is one minus the covariance.
"""

from collections.abc import Callable
from dataclasses import dataclass

from posefield.common.units import Floats
from posefield.kriging.covariance import COVARIANCE_MODELS, RATE32, RATE52
from posefield_train.onnx_graph.graph_builder import GraphBuilder


@dataclass(frozen=True)
class Covariance:
    """A covariance of squared distances: a NumPy function, and a builder of its ONNX nodes."""

    numpy: Callable[[Floats], Floats]
    onnx: Callable[[GraphBuilder, str], str]


def _exponential_onnx(net: GraphBuilder, squared: str) -> str:
    return net("Exp", net("Mul", net("Sqrt", squared), net.number(-3.0)))


def _gaussian_onnx(net: GraphBuilder, squared: str) -> str:
    return net("Exp", net("Mul", squared, net.number(-3.0)))


def _spherical_onnx(net: GraphBuilder, squared: str) -> str:
    h = net("Min", net("Sqrt", squared), net.number(1.0))
    cubed = net("Mul", net("Mul", h, h), h)
    falling = net("Sub", net("Mul", cubed, net.number(0.5)), net("Mul", h, net.number(1.5)))
    return net("Add", falling, net.number(1.0))


def _matern32_onnx(net: GraphBuilder, squared: str) -> str:
    a = net("Mul", net("Sqrt", squared), net.number(RATE32))
    return net("Mul", net("Add", a, net.number(1.0)), net("Exp", net("Neg", a)))


def _matern52_onnx(net: GraphBuilder, squared: str) -> str:
    a = net("Mul", net("Sqrt", squared), net.number(RATE52))
    linear = net("Add", a, net.number(1.0))
    growing = net("Add", net("Mul", squared, net.number(RATE52**2 / 3.0)), linear)
    return net("Mul", growing, net("Exp", net("Neg", a)))


_GRAPHS = {
    "exponential": _exponential_onnx,
    "gaussian": _gaussian_onnx,
    "spherical": _spherical_onnx,
    "matern32": _matern32_onnx,
    "matern52": _matern52_onnx,
}
COVARIANCES = {
    name: Covariance(formula, _GRAPHS[name]) for name, formula in COVARIANCE_MODELS.items()
}
