"""Precomputation from aligned clips to everything that a pose needs, ours and the naive one."""

import numpy as np

from model_export import align, hosvd, kriging, tensor, tune, variogram
from model_export import naive as per_frame
from model_export.evaluate.table1_family import Family
from model_export.hosvd import Multilinear
from model_export.kriging import Hyper, Kriging
from model_export.naive import Fitter, Naive

OURS = "metric, whitened tensor, HOSVD at the given ranks, one variogram, one kriging system"
NAIVE = (
    "naive kriging: kinematics of all frames, then for each frame the dissimilarity of all pairs "
    "of poses, an experimental variogram, its fit by {}, and a kriging system with its inverse"
)
FITS: dict[str, Fitter] = {
    "SciPy's least_squares": variogram.fit_by_search,
    "our own linearised grid search": variogram.fit,
}


def ours(made: Family, ranks: tuple[int, int, int]) -> tuple[Multilinear, Kriging]:
    """Reduced tensor and field of its sample basis, with the variogram's own parameters.

    Dissimilarity of motions is the distance between their slices of the core (Mukai & Kuriyama
    2006, 2). Not in it, as in the paper's figure: alignment; nor our search for scales.
    """
    weights = np.ones(len(made.parents))
    chart = made.trained.tensor.chart
    own = tensor.build(made.vectors, chart, made.parents, made.offsets, weights)
    reduced = hosvd.decompose_at(own.values, ranks)
    return reduced, kriging.solve(guess(made, reduced), made.samples, reduced.bases[2])


def guess(made: Family, reduced: Multilinear) -> Hyper:
    """Parameters of the field by the variogram of the motions' slices of the core."""
    return tune.first_guess(made.samples, reduced.motions, "matern52", (1,))


def naive(made: Family, fitter: Fitter) -> Naive:
    """Naive field of the family's pose vectors."""
    positions = align.positions(made.trained.aligned, made.parents, made.offsets)
    return per_frame.fit(made.samples, positions, made.numbers, "matern52", fitter)
