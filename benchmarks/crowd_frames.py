"""Naive kriging of a crowd in NumPy, in float32: each frame's field is asked at once of all the
characters who are at that frame."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from family import Family
from paper import naive_kriging, poses
from scipy import linalg

from posefield.common.units import Indices, Singles
from posefield_train.kriging.kriging_graph import COVARIANCES
from posefield_train.kriging.universal_kriging import UniversalKriging

Answer = Callable[[], list[Singles]]
"""Function that returns rotations (N, J, 4)."""


@dataclass(frozen=True)
class Questions:
    """Points (N, d) in half-ranges, whole canonical frames before the times (N,), and shares (N, 1)
    of the next. To find frames is ours to pay: the rivals are given them."""

    points: Singles
    below: Indices
    share: Singles


def solved(
    trained_family: Family, field: naive_kriging.NaiveKriging, questions: Questions
) -> Answer:
    """Poses by LU factors of each frame's system, made beforehand, and averages of the samples."""
    factors = [linalg.lu_factor(poses.system(one).astype(np.float32)) for one in field.fields]
    values = field.values.astype(np.float32)
    n = values.shape[0]

    def frame(index: int, basis: Singles) -> Singles:
        weights = linalg.lu_solve(factors[index], basis.T, check_finite=False)[:n]
        return weights.T @ values[:, index]

    return _by_frame(trained_family, field, questions, frame)


def dual(trained_family: Family, field: naive_kriging.NaiveKriging, questions: Questions) -> Answer:
    """Poses by inverse and samples multiplied beforehand."""
    duals = [one.dual.astype(np.float32) for one in field.fields]
    return _by_frame(trained_family, field, questions, lambda index, basis: basis @ duals[index])


def _by_frame(
    trained_family: Family,
    field: naive_kriging.NaiveKriging,
    questions: Questions,
    frame: Callable[[int, Singles], Singles],
) -> Answer:
    """Poses of everybody, frame after frame, where `frame` makes pose vectors of a basis."""
    means = trained_family.trained.model.decoder.means.astype(np.float32)
    fields = [_singles(one) for one in field.fields]

    def run() -> list[Singles]:
        order = np.argsort(questions.below, kind="stable")
        firsts = np.searchsorted(questions.below[order], np.arange(len(fields)))
        values = np.empty((len(order), field.values.shape[2]), np.float32)
        for index, rows in enumerate(np.split(order, firsts[1:])):
            if not len(rows):
                continue
            before, after = (
                frame(at, _basis(fields[at], questions.points[rows])) for at in (index, index + 1)
            )
            values[rows] = before + questions.share[rows] * (after - before)
        return [decoded(values[:, 3:], means)]

    return run


@dataclass(frozen=True)
class Single:
    """Samples (n, d) of a field in float32, so that distances are the covariance's squared."""

    samples: Singles
    scale: np.float32
    covariance: Callable[[Singles], Singles]


def _singles(field: UniversalKriging) -> Single:
    hyper = field.hyper
    scale = np.float32(hyper.scales[0])
    samples = field.samples.astype(np.float32) * scale
    return Single(samples, scale, COVARIANCES[hyper.covariance].numpy)


def _basis(field: Single, points: Singles) -> Singles:
    """Covariances and drift (K, n + 1 + d)."""
    scaled = points * field.scale
    squared = np.square(scaled).sum(axis=1)[:, None] + np.square(field.samples).sum(axis=1)
    squared -= 2.0 * scaled @ field.samples.T
    near = field.covariance(np.maximum(squared, np.float32(0.0)))
    return np.hstack([near, np.ones((len(points), 1), np.float32), points])


def decoded(turned: Singles, means: Singles) -> Singles:
    """Quaternions (N, J, 4) as the model's decoder makes them, poses innermost while it does."""
    joints = np.ascontiguousarray(turned.T).reshape(*means.shape, -1)
    half = np.sqrt(np.sum(np.square(joints), axis=1, keepdims=True) + np.float32(1e-12))
    quaternions = joints * (np.sin(half) / half) + means[..., None] * np.cos(half)
    return np.ascontiguousarray(quaternions.transpose(2, 0, 1))
