"""Naive kriging, the paper's baseline: a variogram and a kriging system for every frame.

This is the method of Mukai & Kuriyama (TOG 2005) and the "naive" row of table 1 of Mukai & Kuriyama
2006. It serves as a reference only. The dissimilarity of two poses is the distance between their
joints; pose vectors are interpolated directly.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from scipy.optimize import least_squares

from paper import variogram
from paper.variogram import RANGES, ExperimentalVariogram, VariogramModel
from posefield.common.units import Floats, PointControls, PoseVectors
from posefield.kriging.kriging_model import Hyper
from posefield_train.kriging import universal_kriging
from posefield_train.kriging.kriging_graph import COVARIANCES
from posefield_train.kriging.universal_kriging import UniversalKriging
from posefield_train.onnx_graph import GraphBuilder

VariogramFitter = Callable[[ExperimentalVariogram, str], VariogramModel]


@dataclass(frozen=True)
class NaiveKriging:
    """One isotropic kriging model per frame over the same samples.

    values: pose vectors (N, T, D).
    """

    fields: tuple[UniversalKriging, ...]
    values: PoseVectors

    def numpy(self, points: PointControls) -> Annotated[Floats, "points frames dof"]:
        """Return pose vectors (B, T, D) at points (B, d) in half-ranges, as weighted averages."""
        weights = np.stack([field.weights(points) for field in self.fields], axis=1)
        return np.einsum("btn,ntd->btd", weights, self.values, optimize=True)

    def onnx(self, net: GraphBuilder, points: str) -> str:
        """Build pose vectors (T, D) at one point (1, d) by weighted averages of the samples.

        The weights come from the inverse of each frame's system, as in the paper.
        """
        basis = self.basis(net, points)
        inverse = np.stack([field.weighing for field in self.fields])
        weights = net("MatMul", basis, net.weights("inverses", inverse))
        samples = net.weights("values", self.values.transpose(1, 0, 2))
        return net("Squeeze", net("MatMul", weights, samples), net.indices(1))

    def onnx_dual(self, net: GraphBuilder, points: str) -> str:
        """Build `onnx` with premultiplied weights and samples, which halves the numbers read."""
        duals = np.stack(
            [
                field.weighing @ values
                for field, values in zip(self.fields, self.values.swapaxes(0, 1), strict=True)
            ]
        )
        product = net("MatMul", self.basis(net, points), net.weights("duals", duals))
        return net("Squeeze", product, net.indices(1))

    def basis(self, net: GraphBuilder, points: str) -> str:
        """Build covariances and drift (T, 1, n + k) of one point for every frame's model."""
        samples = self.fields[0].samples
        gaps = net("Sub", points, net.weights("naive_samples", samples))
        squared = net("ReduceSum", net("Mul", gaps, gaps), net.indices(1), keepdims=0)
        kind = COVARIANCES[self.fields[0].hyper.covariance]
        worth = kind.gain * np.array([field.hyper.scales[:1] ** 2 for field in self.fields])
        covariance = kind.onnx(net, net("Mul", net.weights("naive_scales", worth), squared))
        one = net.weights("one", np.ones((1, 1)))
        drift = net("Concat", one, points, axis=1)
        frames = net.indices(len(self.fields), samples.shape[1] + 1)
        both = net("Concat", covariance, net("Expand", drift, frames), axis=1)
        return net("Unsqueeze", both, net.indices(1))


def fit_naive(
    points: Annotated[Floats, "clips controls"],
    positions: Annotated[Floats, "clips frames ..."],
    values: PoseVectors,
    covariance: str,
    fitter: VariogramFitter,
) -> NaiveKriging:
    """Fit naive kriging to values (N, T, D) of each frame at points (N, d).

    positions: joint positions (N, T, J, 3), or other quantities (N, T, ...), whose distances the
    variogram is fitted to. fitter: fits a variogram model to each frame's experimental variogram.
    """
    fields = []
    for frame in range(values.shape[1]):
        poses = positions[:, frame].reshape(len(points), -1)
        left = variogram.residuals(points, poses, 1)
        fitted = fitter(variogram.experimental_variogram(points, left), covariance)
        nugget = np.clip(fitted.nugget / fitted.sill if fitted.sill > 0 else 10.0, 1e-4, 10.0)
        scales = np.full(points.shape[1], 1.0 / fitted.range)
        hyper = Hyper(covariance, (1,), scales, float(nugget), 0.0)
        fields.append(universal_kriging.solve(hyper, points, values[:, frame]))
    return NaiveKriging(tuple(fields), values)


def fit_by_search(experimental: ExperimentalVariogram, covariance: str) -> VariogramModel:
    """Fit nugget, sill and range together by a general least-squares solver, as is common."""
    top, far = float(experimental.values.max()), float(experimental.distances.max())
    roots = np.sqrt(experimental.pairs) / np.maximum(experimental.values, 1e-30)

    def misfit(x: Floats) -> Floats:
        squared = np.square(experimental.distances / x[2])
        rising = 1.0 - COVARIANCES[covariance].numpy(squared)
        return roots * (x[0] + x[1] * rising - experimental.values)

    low, high = [0.0, 0.0, RANGES[0]], [2.0 * top, 10.0 * top, RANGES[-1]]
    start, sizes = [0.1 * top, 0.9 * top, 0.5 * far], [top, top, far]
    return VariogramModel(
        *map(float, least_squares(misfit, start, bounds=(low, high), x_scale=sizes).x)
    )
