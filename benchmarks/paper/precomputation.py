"""Precomputation from aligned clips to all that a pose needs, by posefield and naive kriging."""

from functools import reduce

import numpy as np
from family import Family

from paper import naive_kriging as per_frame
from paper import variogram
from paper.naive_kriging import NaiveKriging, VariogramFitter
from posefield.common.units import Floats
from posefield.kriging.kriging_model import Hyper
from posefield_train.align import time_alignment
from posefield_train.kriging import universal_kriging
from posefield_train.kriging.universal_kriging import UniversalKriging
from posefield_train.tensor import hosvd, motion_tensor
from posefield_train.tensor.hosvd import TuckerTensor

OURS = "metric, whitened tensor, HOSVD at the given ranks, one variogram, one kriging system"
NAIVE = (
    "naive kriging: kinematics of all frames, then for each frame the dissimilarity of all pairs "
    "of poses, an experimental variogram fitted by {}, and a kriging system with its inverse"
)
# Range of the nugget, in sills.
NUGGETS = 1e-3, 10.0
FITS: dict[str, VariogramFitter] = {
    "SciPy's least_squares": per_frame.fit_by_search,
    "our own linearised grid search": variogram.fit_by_grid,
}


def ours(
    trained_family: Family, ranks: tuple[int, int, int]
) -> tuple[TuckerTensor, UniversalKriging]:
    """Return the reduced tensor and the kriging model of its sample basis.

    The dissimilarity of two motions is the distance between their slices of the core (Mukai &
    Kuriyama 2006, section 2). Alignment is not included, as in the paper, nor the search for scales
    that posefield's training adds.
    """
    weights = np.ones(len(trained_family.parents))
    chart = trained_family.trained.tensor.chart
    tensor = motion_tensor.build_tensor(
        trained_family.vectors, chart, trained_family.parents, trained_family.offsets, weights
    )
    reduced = decompose_truncated(tensor.values, ranks)
    return reduced, universal_kriging.solve(
        guess(trained_family, reduced), trained_family.samples, reduced.bases[2]
    )


def decompose_truncated(tensor: Floats, ranks: tuple[int, ...]) -> TuckerTensor:
    """Return `hosvd.decompose` truncated to ranks; only that part of the core is computed."""
    bases = []
    for mode, rank in enumerate(ranks):
        unfolded = hosvd.unfold(tensor, mode)
        _, vectors = np.linalg.eigh(unfolded @ unfolded.T)
        bases.append(hosvd.fix_signs(vectors[:, ::-1])[:, :rank])
    core = reduce(lambda x, mb: hosvd.mode_dot(x, mb[1].T, mb[0]), enumerate(bases), tensor)
    return TuckerTensor(core, tuple(bases))


def guess(trained_family: Family, reduced: TuckerTensor) -> Hyper:
    """Return kriging parameters from the variogram of the motions' slices of the core."""
    left = variogram.residuals(trained_family.samples, reduced.motions, 1)
    experimental = variogram.experimental_variogram(trained_family.samples, left)
    fitted = variogram.fit_by_grid(experimental, "matern52")
    nugget = fitted.nugget / fitted.sill if fitted.sill > 0.0 else NUGGETS[1]
    scales = np.full(trained_family.samples.shape[1], 1.0 / fitted.range)
    return Hyper("matern52", (1,), scales, float(np.clip(nugget, *NUGGETS)), 0.0)


def naive(trained_family: Family, fitter: VariogramFitter) -> NaiveKriging:
    """Return the per-frame kriging model of the family's pose vectors."""
    positions = time_alignment.joint_positions(
        trained_family.trained.aligned, trained_family.parents, trained_family.offsets
    )
    return per_frame.fit_naive(
        trained_family.samples, positions, trained_family.numbers, "matern52", fitter
    )
