"""Table 1's error: distances summed over joints and frames, their root mean square over controls.

Motions are compared in canonical time with the family's mean bones, so that what differs is the
pose field. Ours has the variogram of its core's slices, as the paper's has.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from model_export import kriging, ranks
from model_export.cost import Price
from model_export.decoder import Decoder
from model_export.evaluate import table1_precompute
from model_export.evaluate.table1_family import Family
from model_export.hosvd import Multilinear
from model_export.kriging import Hyper, Kriging
from model_export.naive import Naive
from model_export.ranks import Front, Triple
from service.motion import skeleton
from service.motion.conventions import Floats

# Control points over which ranks are looked for, before all of them judge; and those at a time.
SOME, CHUNK = 100, 100
SEED = 2006

Poses = Callable[[Floats], tuple[Floats, Floats]]
"""Rotations (B, T, J, 4) and root positions (B, T, 3), m, at points (B, d) in half-ranges."""


@dataclass(frozen=True)
class Errors:
    """Errors over control points (Q, d) in half-ranges, uniform in the box of the sampled ones."""

    made: Family
    points: Floats
    hyper: Hyper

    @cached_property
    def whole(self) -> Floats:
        """Joint positions (Q, T, J, 3), m, of the model at full rank."""
        return self.positions(self.of(self.made.trained.full))

    def truncation(self, reduced: Multilinear) -> float:
        """Summed distance, m, of a truncation from the full rank, kriged by the same weights."""
        return between(self.positions(self.of(reduced)), self.whole)

    def positions(self, poses: Poses) -> Floats:
        """Joint positions (Q, T, J, 3), m."""
        chunks = range(0, len(self.points), CHUNK)
        return np.concatenate([self._some(poses, self.points[i : i + CHUNK]) for i in chunks])

    def _some(self, poses: Poses, points: Floats) -> Floats:
        rotations, root = poses(points)
        translations = skeleton.translations(self.made.offsets.mean(axis=0), root)
        return skeleton.forward(self.made.parents, rotations, translations)[0]

    def field(self, reduced: Multilinear) -> Kriging:
        """Field of a truncation's sample basis."""
        return kriging.solve(self.hyper, self.made.samples, reduced.bases[2])

    def of(self, reduced: Multilinear) -> Poses:
        """Poses of a truncation."""
        own, field = self.made.trained.tensor, self.field(reduced)
        decoder = Decoder(reduced, own.mean, own.unwhiten, own.chart.means)
        frames = np.arange(float(own.values.shape[1]))
        return lambda points: decoder.numpy(
            field.predict(points), np.tile(frames, (len(points), 1))
        )

    def of_naive(self, field: Naive) -> Poses:
        """Poses of naive kriging of the degrees of freedom that vary."""
        own = self.made.trained.tensor

        def poses(points: Floats) -> tuple[Floats, Floats]:
            varying = field.numpy(points)
            numbers = np.tile(own.mean, (*varying.shape[:2], 1))
            numbers[..., self.made.varies] = varying
            return own.chart.poses(numbers)

        return poses


def uniform(made: Family, count: int) -> Errors:
    """Errors over so many control points; the same at every call."""
    rng = np.random.Generator(np.random.PCG64(SEED))
    points = rng.uniform(-1.0, 1.0, (count, made.samples.shape[1]))
    return Errors(made, points, table1_precompute.guess(made, made.trained.full))


def between(found: Floats, expected: Floats) -> float:
    """Root mean square over motions of distances summed over joints and frames, m."""
    sums = np.sum(np.linalg.norm(found - expected, axis=-1), axis=(1, 2))
    return float(np.sqrt(np.mean(np.square(sums))))


def smallest(errors: Errors, threshold: float) -> Triple:
    """Ranks of the smallest core whose summed distance from the full rank is at most so many m.

    Looked for along the front of cores by size and error in the metric, at some of the points;
    all of them confirm it.
    """
    made, full = errors.made, errors.made.trained.full
    some = replace(errors, points=errors.points[:SOME])
    places = made.trained.tensor.values[0].size * len(made.parents)
    own = _front(errors)
    found = ranks.cheapest(
        own,
        lambda triple: some.truncation(full.truncated(triple)) / threshold,
        (threshold / (made.vectors.shape[1] * len(made.parents))) ** 2 * places,
    )
    place = [own[place] for place in range(len(own.errors))].index(found)
    while errors.truncation(full.truncated(own[place])) > threshold:
        place += 1
    return own[place]


def _front(errors: Errors) -> Front:
    """Front of cores whose sample mode weighs as much as kriging uses it at the points.

    Kriging smooths: what the last sample directions hold it predicts smaller than it was sampled.
    """
    full = errors.made.trained.full
    predicted = errors.field(full).predict(errors.points)
    used = np.mean(np.square(predicted), axis=0) * len(errors.made.samples)
    return ranks.front(full.core * np.sqrt(used), Price((0, 0, 0)))
