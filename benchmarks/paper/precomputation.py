"""Precomputation from aligned clips to all that a pose needs, by posefield and naive kriging."""

import numpy as np
from family import Family

from model_export import align, hosvd, kriging, tensor, tune, variogram
from model_export import naive as per_frame
from model_export.hosvd import Multilinear
from model_export.kriging import Hyper, Kriging
from model_export.naive import Fitter, Naive

OURS = "metric, whitened tensor, HOSVD at the given ranks, one variogram, one kriging system"
NAIVE = (
    "naive kriging: kinematics of all frames, then for each frame the dissimilarity of all pairs "
    "of poses, an experimental variogram fitted by {}, and a kriging system with its inverse"
)
FITS: dict[str, Fitter] = {
    "SciPy's least_squares": variogram.fit_by_search,
    "our own linearised grid search": variogram.fit,
}


def ours(made: Family, ranks: tuple[int, int, int]) -> tuple[Multilinear, Kriging]:
    """Return the reduced tensor and the kriging model of its sample basis.

    The dissimilarity of two motions is the distance between their slices of the core (Mukai &
    Kuriyama 2006, section 2). Alignment is not included, as in the paper, nor the search for scales
    that posefield's training adds.
    """
    weights = np.ones(len(made.parents))
    chart = made.trained.tensor.chart
    own = tensor.build(made.vectors, chart, made.parents, made.offsets, weights)
    reduced = hosvd.decompose_at(own.values, ranks)
    return reduced, kriging.solve(guess(made, reduced), made.samples, reduced.bases[2])


def guess(made: Family, reduced: Multilinear) -> Hyper:
    """Return kriging parameters from the variogram of the motions' slices of the core."""
    experimental = variogram.of_residuals(made.samples, reduced.motions, 1)
    return tune.first_guess(experimental, made.samples.shape[1], "matern52", (1,))


def naive(made: Family, fitter: Fitter) -> Naive:
    """Return the per-frame kriging model of the family's pose vectors."""
    positions = align.positions(made.trained.aligned, made.parents, made.offsets)
    return per_frame.fit(made.samples, positions, made.numbers, "matern52", fitter)
