"""Covariances of unit sill and unit range: formula in NumPy and in ONNX side by side.

Each takes the squared distance, which is what the graph has at hand. Ranges are practical: at
distance one 95 % of the sill is reached (all of it for the spherical one). The variogram is one
minus the covariance.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from model_export.net import Net
from service.motion.conventions import Floats

# Where the Matérn covariances of unit rate have fallen to 5 %.
RATE32, RATE52 = 4.743865, 5.918277


@dataclass(frozen=True)
class Covariance:
    """One covariance: of squared distances (…) in NumPy, of a graph's value in ONNX."""

    numpy: Callable[[Floats], Floats]
    onnx: Callable[[Net, str], str]


def _exponential(squared: Floats) -> Floats:
    return np.exp(-3.0 * np.sqrt(squared))


def _exponential_onnx(net: Net, squared: str) -> str:
    return net("Exp", net("Mul", net("Sqrt", squared), net.number(-3.0)))


def _gaussian(squared: Floats) -> Floats:
    return np.exp(-3.0 * squared)


def _gaussian_onnx(net: Net, squared: str) -> str:
    return net("Exp", net("Mul", squared, net.number(-3.0)))


def _spherical(squared: Floats) -> Floats:
    h = np.minimum(np.sqrt(squared), 1.0)
    return 1.0 - 1.5 * h + 0.5 * h**3


def _spherical_onnx(net: Net, squared: str) -> str:
    h = net("Min", net("Sqrt", squared), net.number(1.0))
    cubed = net("Mul", net("Mul", h, h), h)
    falling = net("Sub", net("Mul", cubed, net.number(0.5)), net("Mul", h, net.number(1.5)))
    return net("Add", falling, net.number(1.0))


def _matern32(squared: Floats) -> Floats:
    a = RATE32 * np.sqrt(squared)
    return (1.0 + a) * np.exp(-a)


def _matern32_onnx(net: Net, squared: str) -> str:
    a = net("Mul", net("Sqrt", squared), net.number(RATE32))
    return net("Mul", net("Add", a, net.number(1.0)), net("Exp", net("Neg", a)))


def _matern52(squared: Floats) -> Floats:
    a = RATE52 * np.sqrt(squared)
    return (1.0 + a + RATE52**2 / 3.0 * squared) * np.exp(-a)


def _matern52_onnx(net: Net, squared: str) -> str:
    a = net("Mul", net("Sqrt", squared), net.number(RATE52))
    linear = net("Add", a, net.number(1.0))
    growing = net("Add", net("Mul", squared, net.number(RATE52**2 / 3.0)), linear)
    return net("Mul", growing, net("Exp", net("Neg", a)))


COVARIANCES = {
    "exponential": Covariance(_exponential, _exponential_onnx),
    "gaussian": Covariance(_gaussian, _gaussian_onnx),
    "spherical": Covariance(_spherical, _spherical_onnx),
    "matern32": Covariance(_matern32, _matern32_onnx),
    "matern52": Covariance(_matern52, _matern52_onnx),
}
