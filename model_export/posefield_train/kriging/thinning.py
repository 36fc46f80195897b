"""Kriging with fewer samples for coarser levels of detail.

At the finest level most of the cost of a pose is in distances and covariances, which truncation of
the tensor does not reduce. A coarser level uses only the most informative samples and the pose's
covariance, with weights for all quantities that fit the full models by least squares.
"""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from posefield.common.units import Floats, Indices
from posefield.kriging import kriging_model
from posefield_train.kriging.kriging_bank import (
    POSE,
    VARIANCE,
    ConstantModel,
    KrigingBank,
)
from posefield_train.kriging.sample_points import LabelNames
from posefield_train.kriging.universal_kriging import UniversalKriging

FIT_POINTS = 2_000
# Range of the fit in half-ranges: beyond the samples, so that the weights hold there too.
FIT_RANGE = 1.25
# Directions of the basis below this share of the largest are dropped: their large weights would
# lose precision in float32.
RELATIVE_CUTOFF = 1e-5


def sort_samples(bank: KrigingBank) -> KrigingBank:
    """Return the bank with its samples sorted by how much they explain of the pose."""
    order = pivoted_order(bank.pose)
    other_models = {
        name: field if isinstance(field, ConstantModel) else _permute_kriging(field, order)
        for name, field in bank.other_models.items()
    }
    event = _permute_kriging(bank.event, order) if bank.event else None
    contacts = _permute_kriging(bank.contacts, order) if bank.contacts else None
    pose = _permute_kriging(bank.pose, order)
    return replace(bank, pose=pose, other_models=other_models, event=event, contacts=contacts)


def pivoted_order(pose: UniversalKriging) -> Annotated[Indices, "samples"]:
    """Return samples (n,), each the least determined by the previous ones (pivoted Cholesky)."""
    left = kriging_model.stationary_covariances(pose.hyper, pose.samples, pose.samples)
    pivots: list[int] = []
    for _ in range(len(left)):
        unknown = np.diagonal(left).copy()
        unknown[pivots] = -1.0
        # Rounded, so that rounding errors do not break ties.
        chosen = int(np.argmax(np.round(unknown, 9)))
        pivots.append(chosen)
        if unknown[chosen] > RELATIVE_CUTOFF:
            left = left - np.outer(left[chosen], left[chosen]) / unknown[chosen]
    return np.array(pivots)


def _permute_kriging(
    field: UniversalKriging, order: Annotated[Indices, "samples"]
) -> UniversalKriging:
    rows = np.concatenate([order, np.arange(len(order), len(field.dual))])
    return UniversalKriging(
        field.hyper,
        field.samples[order],
        field.dual[rows],
        field.weighing[np.ix_(rows, order)],
        field.form[np.ix_(rows, rows)],
    )


def random_points(
    bank: KrigingBank, reach: float, count: int
) -> Annotated[Floats, "{count} coordinates"]:
    """Return random points (Q, d + p) within `reach` half-ranges.

    In each label set no name is as likely as each of the names.
    """
    rng = np.random.Generator(np.random.PCG64(count))
    controls = rng.uniform(-reach, reach, (count, len(bank.low)))
    return np.hstack([controls, *random_labels(rng, bank.labels, count)])


def random_labels(
    rng: np.random.Generator, label_names: LabelNames, count: int
) -> list[Annotated[Floats, "{count} _"]]:
    """Return one-hot weights (Q, .) of random names for each label set; zeros for no name."""
    sizes = map(len, label_names.values())
    return [np.eye(size + 1, size)[rng.integers(0, size + 1, count)] for size in sizes]


@dataclass(frozen=True)
class ThinningData:
    """Fit data of coarser levels: values of a bank's models at points beyond its samples.

    basis: labels, one, controls and all covariances (P, p + 1 + d + m). values: (P, m) by
    name.
    """

    basis: Annotated[Floats, "points rows"]
    values: dict[str, Annotated[Floats, "points _"]]
    bank: KrigingBank

    def weights(self, columns: int, rank: int, error: float) -> Annotated[Floats, "rows columns"]:
        """Return weights (p + 1 + d + m, M) of the first m covariances.

        rank: number of pose coefficients. error: of the level, m, added to its variance.
        """
        logarithms = np.log(self.values[VARIANCE] + error**2 / self.bank.sill)
        values = np.hstack(list({**self.values, VARIANCE: logarithms}.values()))
        count = values.shape[1] - (self.values[POSE].shape[1] - rank)
        columns_of_basis = self.basis[:, : self.bank.linear + columns]
        solution = np.linalg.lstsq(columns_of_basis, values[:, :count], rcond=RELATIVE_CUTOFF)
        return np.asarray(solution[0], np.float64)


def thinning_data(bank: KrigingBank) -> ThinningData:
    """Return the fit data of a bank of one level."""
    points = np.vstack([random_points(bank, FIT_RANGE, FIT_POINTS), bank.pose.samples])
    return ThinningData(bank.basis(points, bank.columns(0)), bank.kriged(points), bank)
