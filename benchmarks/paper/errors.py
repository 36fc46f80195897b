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

    made: Family
    points: Floats
    hyper: Hyper

    @cached_property
    def whole(self) -> Floats:
        """Joint positions (Q, T, J, 3), m, of the model at full rank."""
        return self.positions(self.of(self.made.trained.full))

    def truncation(self, reduced: TuckerTensor) -> float:
        """Return the summed distance, m, of a truncation from full rank with the same weights."""
        return between(self.positions(self.of(reduced)), self.whole)

    def positions(self, poses: Poses) -> Floats:
        """Return the joint positions (Q, T, J, 3), m, at all control points."""
        chunks = range(0, len(self.points), CHUNK)
        return np.concatenate([self._some(poses, self.points[i : i + CHUNK]) for i in chunks])

    def _some(self, poses: Poses, points: Floats) -> Floats:
        rotations, root = poses(points)
        translations = skeleton.translations(self.made.offsets.mean(axis=0), root)
        return skeleton.positions(self.made.parents, rotations, translations)

    def field(self, reduced: TuckerTensor) -> UniversalKriging:
        """Return the kriging model of a truncation's sample basis."""
        return universal_kriging.solve(self.hyper, self.made.samples, reduced.bases[2])

    def of(self, reduced: TuckerTensor) -> Poses:
        """Return the pose function of a truncation."""
        own, field = self.made.trained.tensor, self.field(reduced)
        decoder = Decoder(reduced, own.mean, own.unwhiten, own.chart)
        frames = np.arange(float(own.values.shape[1]))
        return lambda points: decoder.numpy(
            field.predict(points), np.tile(frames, (len(points), 1))
        )

    def of_naive(self, field: NaiveKriging) -> Poses:
        """Return the pose function of per-frame kriging of the degrees of freedom that vary."""
        own = self.made.trained.tensor

        def poses(points: Floats) -> tuple[Floats, Floats]:
            varying = field.numpy(points)
            numbers = np.tile(own.mean, (*varying.shape[:2], 1))
            numbers[..., self.made.varies] = varying
            return own.chart.poses(numbers)

        return poses


def uniform(made: Family, count: int) -> Errors:
    """Return the errors over `count` control points, uniform in the sampled box and seeded."""
    rng = np.random.Generator(np.random.PCG64(SEED))
    points = rng.uniform(-1.0, 1.0, (count, made.samples.shape[1]))
    return Errors(made, points, precomputation.guess(made, made.trained.full))


def between(found: Floats, expected: Floats) -> float:
    """Return the RMS over motions of the distances summed over joints and frames, m.

    found, expected (Q, T, J, 3): joint positions, m.
    """
    sums = np.sum(np.linalg.norm(found - expected, axis=-1), axis=(1, 2))
    return float(np.sqrt(np.mean(np.square(sums))))


def smallest(errors: Errors, threshold: float) -> RankTriple:
    """Return the ranks of the smallest core within `threshold`, m, of full rank.

    The search follows the Pareto front of size and error in the training metric, with SOME of the
    control points; all of them confirm the result.
    """
    made, full = errors.made, errors.made.trained.full
    some = replace(errors, points=errors.points[:SOME])
    places = made.trained.tensor.values[0].size * len(made.parents)
    own = _front(errors)
    found = truncation_cost.cheapest_within(
        own,
        lambda triple: some.truncation(full.truncated(triple)) / threshold,
        (threshold / (made.vectors.shape[1] * len(made.parents))) ** 2 * places,
    )
    place = [own[place] for place in range(len(own.errors))].index(found)
    while errors.truncation(full.truncated(own[place])) > threshold:
        place += 1
    return own[place]


def _front(errors: Errors) -> ParetoFront:
    """Return the Pareto front with sample directions weighted by their predicted size.

    Kriging smooths: it predicts smaller coefficients for the last sample directions than the clips
    have.
    """
    full = errors.made.trained.full
    predicted = errors.field(full).predict(errors.points)
    used = np.mean(np.square(predicted), axis=0) * len(errors.made.samples)
    return truncation_cost.pareto_front(full.core * np.sqrt(used), RankCost((0, 0, 0)))
