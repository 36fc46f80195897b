"""The paper's error measure: joint distances summed over joints and frames of a motion, and their
root mean square over control points.

Motions are compared on canonical time with the family's mean bone offsets, so that only the kriging
of the poses differs. Its variogram is that of the core's slices, as in the paper.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from family import Family

from paper import precomputation
from paper.naive_kriging import NaiveKriging
from posefield.common.units import Floats
from posefield.kriging.kriging_model import Hyper
from posefield.motion import skeleton
from posefield_train.graph import truncation_cost
from posefield_train.graph.truncation_cost import ParetoFront, RankCost, RankTriple
from posefield_train.kriging import universal_kriging
from posefield_train.kriging.universal_kriging import UniversalKriging
from posefield_train.tensor.decoder import Decoder
from posefield_train.tensor.hosvd import TuckerTensor

# Control points that the search for ranks uses; control points evaluated together.
SOME, CHUNK = 100, 100
SEED = 2006

Poses = Callable[[Floats], tuple[Floats, Floats]]
"""Rotations (B, T, J, 4) and root positions (B, T, 3), m, at points (B, d) in half-ranges."""


@dataclass(frozen=True)
class Errors:
    """Errors of a family over control points (Q, d) in half-ranges."""

    trained_family: Family
    points: Floats
    hyper: Hyper

    @cached_property
    def whole(self) -> Floats:
        """Joint positions (Q, T, J, 3), m, of the model at full rank."""
        return self.positions(self.of(self.trained_family.trained.full))

    def truncation(self, reduced: TuckerTensor) -> float:
        """Return the summed distance, m, of a truncation from full rank with the same weights."""
        return between(self.positions(self.of(reduced)), self.whole)

    def positions(self, poses: Poses) -> Floats:
        """Return the joint positions (Q, T, J, 3), m, at all control points."""
        chunks = range(0, len(self.points), CHUNK)
        return np.concatenate([self._some(poses, self.points[i : i + CHUNK]) for i in chunks])

    def _some(self, poses: Poses, points: Floats) -> Floats:
        rotations, root = poses(points)
        translations = skeleton.translations(self.trained_family.offsets.mean(axis=0), root)
        return skeleton.positions(self.trained_family.parents, rotations, translations)

    def field(self, reduced: TuckerTensor) -> UniversalKriging:
        """Return the kriging model of a truncation's sample basis."""
        return universal_kriging.solve(self.hyper, self.trained_family.samples, reduced.bases[2])

    def of(self, reduced: TuckerTensor) -> Poses:
        """Return the pose function of a truncation."""
        tensor, field = self.trained_family.trained.tensor, self.field(reduced)
        decoder = Decoder(reduced, tensor.mean, tensor.unwhiten, tensor.chart)
        frames = np.arange(float(tensor.values.shape[1]))
        return lambda points: decoder.numpy(
            field.predict(points), np.tile(frames, (len(points), 1))
        )

    def of_naive(self, field: NaiveKriging) -> Poses:
        """Return the pose function of per-frame kriging of the degrees of freedom that vary."""
        tensor = self.trained_family.trained.tensor

        def poses(points: Floats) -> tuple[Floats, Floats]:
            varying = field.numpy(points)
            numbers = np.tile(tensor.mean, (*varying.shape[:2], 1))
            numbers[..., self.trained_family.varies] = varying
            return tensor.chart.poses(numbers)

        return poses


def uniform(trained_family: Family, count: int) -> Errors:
    """Return the errors over `count` control points, uniform in the sampled box and seeded."""
    rng = np.random.Generator(np.random.PCG64(SEED))
    points = rng.uniform(-1.0, 1.0, (count, trained_family.samples.shape[1]))
    return Errors(
        trained_family, points, precomputation.guess(trained_family, trained_family.trained.full)
    )


def between(values: Floats, expected: Floats) -> float:
    """Return the RMS over motions of the distances summed over joints and frames, m.

    found, expected (Q, T, J, 3): joint positions, m.
    """
    sums = np.sum(np.linalg.norm(values - expected, axis=-1), axis=(1, 2))
    return float(np.sqrt(np.mean(np.square(sums))))


def smallest(errors: Errors, threshold: float) -> RankTriple:
    """Return the ranks of the smallest core within `threshold`, m, of full rank.

    The search follows the Pareto front of size and error in the training metric, with SOME of the
    control points; all of them confirm the result.
    """
    trained_family, full = errors.trained_family, errors.trained_family.trained.full
    some = replace(errors, points=errors.points[:SOME])
    count = trained_family.trained.tensor.values[0].size * len(trained_family.parents)
    front = _front(errors)
    cheapest = truncation_cost.cheapest_within(
        front,
        lambda triple: some.truncation(full.truncated(triple)) / threshold,
        (threshold / (trained_family.vectors.shape[1] * len(trained_family.parents))) ** 2 * count,
    )
    index = [front[index] for index in range(len(front.errors))].index(cheapest)
    while errors.truncation(full.truncated(front[index])) > threshold:
        index += 1
    return front[index]


def _front(errors: Errors) -> ParetoFront:
    """Return the Pareto front with sample directions weighted by their predicted size.

    Kriging smooths: it predicts smaller coefficients for the last sample directions than the clips
    have.
    """
    full = errors.trained_family.trained.full
    predicted = errors.field(full).predict(errors.points)
    used = np.mean(np.square(predicted), axis=0) * len(errors.trained_family.samples)
    return truncation_cost.pareto_front(full.core * np.sqrt(used), RankCost((0, 0, 0)))
