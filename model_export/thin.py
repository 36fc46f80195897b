"""Kriging thinned out for coarser levels of detail.

What the finest level costs at every pose is mostly distances and covariances, which no truncation
of the tensor saves. A coarser level asks fewer samples, those that say most, of the pose's field
alone, and has all fields of them by the weights whose answers come nearest to what all fields say.
"""

from dataclasses import dataclass, replace

import numpy as np

from model_export import kriging
from model_export.field_bank import VARIANCE, Constant, Field, FieldBank
from model_export.kriging import Kriging
from service.motion.conventions import Floats, Indices

QUESTIONS = 2_000
# Weights are fitted somewhat beyond the samples, so that they are held there too.
BEYOND = 1.25
# Directions of the basis below this share of the largest would need weights that float32 spoils.
FAINTEST = 1e-5


def ordered(bank: FieldBank) -> FieldBank:
    """The same bank with its samples in the order in which they say most of the pose."""
    order = spread_order(bank.pose)
    others = {name: _reordered(field, order) for name, field in bank.others.items()}
    return replace(bank, pose=_permuted(bank.pose, order), others=others)


def spread_order(pose: Kriging) -> Indices:
    """Samples (n,) each of which the ones before it say least of (pivoted Cholesky)."""
    left = kriging.covariances(pose.hyper, pose.samples, pose.samples)
    taken: list[int] = []
    for _ in range(len(left)):
        unknown = np.diagonal(left).copy()
        unknown[taken] = -1.0
        # Rounded, so that ties are not broken by an ulp.
        chosen = int(np.argmax(np.round(unknown, 9)))
        taken.append(chosen)
        if unknown[chosen] > FAINTEST:
            left = left - np.outer(left[chosen], left[chosen]) / unknown[chosen]
    return np.array(taken)


def _reordered(field: Field, order: Indices) -> Field:
    return field if isinstance(field, Constant) else _permuted(field, order)


def _permuted(field: Kriging, order: Indices) -> Kriging:
    rows = np.concatenate([order, np.arange(len(order), len(field.dual))])
    return Kriging(
        field.hyper,
        field.samples[order],
        field.dual[rows],
        field.weighing[np.ix_(rows, order)],
        field.form[np.ix_(rows, rows)],
    )


def questions(bank: FieldBank, reach: float, count: int) -> Floats:
    """Random points (Q, d + p) within so many half-ranges; nobody moves as often as each performer
    does."""
    rng = np.random.Generator(np.random.PCG64(count))
    controls = rng.uniform(-reach, reach, (count, len(bank.low)))
    performers = len(bank.performers)
    labels = np.eye(performers + 1, performers)[rng.integers(0, performers + 1, count)]
    return np.hstack([controls, labels])


@dataclass(frozen=True)
class Lesson:
    """What a bank's fields say at points beyond its samples, for coarser levels to learn.

    basis (P, p + 1 + d + m): labels, one, controls and all covariances. said: values (P, m) by
    name.
    """

    basis: Floats
    said: dict[str, Floats]
    bank: FieldBank

    def weights(self, columns: int, rank: int, error: float) -> Floats:
        """Weights (p + 1 + d + m, M) of the first m covariances for a pose of so many coefficients.

        error: of the level's own, m; its variance counts it in.
        """
        own = np.log(self.said[VARIANCE] + error**2 / self.bank.sill)
        values = np.hstack(list({**self.said, VARIANCE: own}.values()))
        kept = values.shape[1] - (self.bank.pose.dual.shape[1] - rank)
        known = self.basis[:, : self.bank.linear + columns]
        found = np.linalg.lstsq(known, values[:, :kept], rcond=FAINTEST)
        return np.asarray(found[0], np.float64)


def lesson(bank: FieldBank) -> Lesson:
    """Lesson of a bank of one level."""
    points = np.vstack([questions(bank, BEYOND, QUESTIONS), bank.pose.samples])
    return Lesson(bank.basis(points, bank.columns(0)), bank.numpy(points), bank)
