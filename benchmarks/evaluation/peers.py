"""Other interpolation methods, which predict values at queries from values at samples.

A peer is a method of a library, not a copy of it. Its inputs are the controls in half-ranges and
the quantities that posefield kriges: reduced motions, bone offsets, duration, warp and travel.
"""

from collections.abc import Callable
from typing import Literal

import numpy as np
from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator, RBFInterpolator
from sklearn.dummy import DummyRegressor
from sklearn.linear_model import LinearRegression
from sklearn.neighbors import KNeighborsRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import PolynomialFeatures

from posefield.common.units import Floats
from posefield_train.kriging.sample_points import SamplePoints

Interpolator = Callable[[SamplePoints, Floats, Floats], Floats]
"""Function of samples, their values (n, m) and queries (q, d + p) that returns values (q, m)."""

SMOOTHINGS = (0.0, *np.geomspace(1e-3, 1e2, 11))


def _controls(samples: SamplePoints, queries: Floats) -> tuple[Floats, Floats]:
    return samples.half_ranges, queries[:, : samples.controls]


Kernel = Literal["thin_plate_spline", "linear", "cubic"]


def _rbf(kernel: Kernel) -> Interpolator:
    def predict(samples: SamplePoints, values: Floats, queries: Floats) -> Floats:
        sample_points, query_points = _controls(samples, queries)
        return _rbf_interpolator(sample_points, values, kernel, 0.0)(query_points)

    return predict


def _rbf_interpolator(
    sample_points: Floats, values: Floats, kernel: Kernel, smoothing: float
) -> RBFInterpolator:
    return RBFInterpolator(
        *_distinct_points(sample_points, values), kernel=kernel, degree=1, smoothing=smoothing
    )


def _distinct_points(sample_points: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return distinct points and the mean value at each: an interpolator needs distinct points."""
    points, indices, counts = np.unique(
        sample_points, axis=0, return_inverse=True, return_counts=True
    )
    sums = np.zeros((len(points), values.shape[1]))
    np.add.at(sums, np.ravel(indices), values)
    return points, sums / counts[:, None]


def thin_plate(smoothing: float) -> Interpolator:
    """Return thin-plate interpolation with a smoothing."""

    def predict(samples: SamplePoints, values: Floats, queries: Floats) -> Floats:
        sample_points, query_points = _controls(samples, queries)
        return _rbf_interpolator(sample_points, values, "thin_plate_spline", smoothing)(
            query_points
        )

    return predict


def _regression(degree: int) -> Interpolator:
    def predict(samples: SamplePoints, values: Floats, queries: Floats) -> Floats:
        sample_points, query_points = _controls(samples, queries)
        model = make_pipeline(PolynomialFeatures(degree), LinearRegression())
        return model.fit(sample_points, values).predict(query_points)

    return predict


def _neighbours(count: int | None, weights: str | Callable[[Floats], Floats]) -> Interpolator:
    def predict(samples: SamplePoints, values: Floats, queries: Floats) -> Floats:
        sample_points, query_points = _controls(samples, queries)
        model = KNeighborsRegressor(
            min(count or len(sample_points), len(sample_points)), weights=weights
        )
        return model.fit(sample_points, values).predict(query_points)

    return predict


def _inverse_square(distances: Floats) -> Floats:
    # At a sample the prediction is that of the sample.
    return 1.0 / np.maximum(np.square(distances), 1e-12)


def nearest_of_performer(samples: SamplePoints, values: Floats, queries: Floats) -> Floats:
    """Return the nearest of the examples that share most labels, such as the performer."""
    result = np.empty((len(queries), values.shape[1]))
    for row, query in enumerate(queries):
        shared = samples.points[:, samples.controls :] @ query[samples.controls :]
        among = shared > shared.max() - 0.5
        sample_points = samples.half_ranges[among]
        model = KNeighborsRegressor(1).fit(sample_points, values[among])
        result[row] = model.predict(query[None, : samples.controls])[0]
    return result


def linear_coefficients(samples: SamplePoints, values: Floats, queries: Floats) -> Floats:
    """Interpolate linearly over simplices of the samples; outside their hull, take the nearest."""
    sample_points, query_points = _controls(samples, queries)
    if samples.controls == 1:
        order = np.argsort(sample_points[:, 0])
        columns = [
            np.interp(query_points[:, 0], sample_points[order, 0], v[order]) for v in values.T
        ]
        return np.stack(columns, axis=1)
    inside = LinearNDInterpolator(sample_points, values)(query_points)
    outside = NearestNDInterpolator(sample_points, values)(query_points)
    return np.where(np.isnan(inside), outside, inside)


def sample_mean(samples: SamplePoints, values: Floats, queries: Floats) -> Floats:
    """Return the mean of all samples for each query."""
    return DummyRegressor().fit(samples.points, values).predict(queries).reshape(len(queries), -1)


LINEAR_PEERS: dict[str, tuple[tuple[Interpolator, ...], str]] = {
    "thin_plate": ((thin_plate(0.0),), "scipy RBFInterpolator, thin plate, degree 1"),
    "thin_plate_smoothed": (
        tuple(map(thin_plate, SMOOTHINGS)),
        "the same, smoothing tuned by leaving out takes for each of motion, bones, duration, warp",
    ),
    "linear_rbf": ((_rbf("linear"),), "scipy RBFInterpolator, linear kernel, degree 1"),
    "cubic_rbf": ((_rbf("cubic"),), "scipy RBFInterpolator, cubic kernel, degree 1"),
    "inverse_distance": (
        (_neighbours(None, _inverse_square),),
        "scikit-learn, weights 1 / distance²",
    ),
    "k_nearest": (
        (_neighbours(5, "distance"),),
        "scikit-learn, 5 nearest, weights 1 / distance",
    ),
    "nearest": ((_neighbours(1, "uniform"),), "scikit-learn, nearest example"),
    "linear_regression": ((_regression(1),), "scikit-learn LinearRegression"),
    "quadratic_regression": ((_regression(2),), "scikit-learn, quadratic polynomial"),
    "linear_coefficients": (
        (linear_coefficients,),
        "multilinear model, coefficients interpolated linearly (scipy LinearNDInterpolator; "
        "nearest outside the hull)",
    ),
    "mean": ((sample_mean,), "the mean motion"),
}
"""Peers whose predictions are linear in the values: each with its settings, and its definition."""
