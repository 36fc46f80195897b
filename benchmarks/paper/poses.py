"""Time per pose of compiled code: posefield against naive kriging with all possible precomputation.

Both methods get the same control points and times, and return pose vectors in float64.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt
from family import Family
from scipy import linalg

from paper import kernels
from paper.naive_kriging import NaiveKriging
from posefield.common.units import Floats
from posefield.kriging import kriging_model
from posefield_train.kriging.universal_kriging import UniversalKriging
from posefield_train.tensor.hosvd import TuckerTensor

OURS = (
    "covariances, kriging weights, core, linear interpolation between two rows of the time basis, "
    "directions"
)
FORMS = {
    "LU, on a frame": "naive pose: covariances of one frame, its kriging system solved by "
    "precomputed LU factors, average of the samples by these weights; at whole frames",
    "LU, between frames": "naive pose: the same for the frames before and after, and linear "
    "interpolation between them",
    "inverse, on a frame": "naive pose: at whole frames, with the inverse of each system "
    "precomputed",
    "dual, on a frame": "naive pose: at whole frames, with inverse times samples precomputed",
}
# The form closest to the times in the paper, and the goal for the ratio.
AIMED = "LU, on a frame"
GOALS = {AIMED: 3.3}


@dataclass(frozen=True)
class Questions:
    """Points (Q, d) in half-ranges, whole frames (Q,) and positions between frames (Q,)."""

    points: Floats
    frames: Floats
    positions: Floats


def questions(trained_family: Family, count: int) -> Questions:
    """Return seeded random questions."""
    rng = np.random.Generator(np.random.PCG64(count))
    samples, frames = trained_family.samples, trained_family.vectors.shape[1]
    whole_frames = rng.integers(0, frames - 1, count).astype(np.float64)
    points = rng.uniform(-1.0, 1.0, (count, samples.shape[1]))
    return Questions(points, whole_frames, whole_frames + rng.uniform(0.01, 0.99, count))


def ours(
    trained_family: Family, reduced: TuckerTensor, field: UniversalKriging, questions: Questions
) -> Callable[[], Floats]:
    """Return a function of the model's pose vectors (Q, D) between frames."""
    tensor = trained_family.trained.tensor
    directions = (reduced.bases[0].T @ tensor.unwhiten.T)[:, trained_family.varies]
    r1, r2, r3 = reduced.core.shape
    core = reduced.core.transpose(2, 1, 0).reshape(r3, r2 * r1)
    arrays = (
        *(field.samples.T, field.hyper.scales, field.dual),
        *(core, reduced.bases[1], directions, tensor.mean[trained_family.varies]),
    )
    return _bound(kernels.ours, questions.points, questions.positions, arrays, (r3, r2 * r1, r1))


def naive(field: NaiveKriging, questions: Questions) -> dict[str, Callable[[], Floats]]:
    """Return functions of pose vectors (Q, D) for each form of the naive method."""
    samples, values = field.fields[0].samples.T, field.values.transpose(1, 0, 2)
    n = samples.shape[1]
    scales = np.stack([one.hyper.scales for one in field.fields])
    systems = np.stack([system(one) for one in field.fields])
    factors = lu_factors(systems)
    inverses = np.linalg.inv(systems)[:, :, :n]
    duals = np.stack([one.dual for one in field.fields])
    size = inverses.shape[1]
    solved = partial(
        _bound, kernels.naive_solved, questions.points, arrays=(samples, scales, *factors, values)
    )
    on_frames = partial(_bound, points=questions.points, positions=questions.frames)
    return {
        "LU, on a frame": solved(positions=questions.frames, sizes=(size,)),
        "LU, between frames": solved(positions=questions.positions, sizes=(size,)),
        "inverse, on a frame": on_frames(
            kernels.naive_inverted, arrays=(samples, scales, inverses, values), sizes=(n,)
        ),
        "dual, on a frame": on_frames(
            kernels.naive_dual, arrays=(samples, scales, duals), sizes=()
        ),
    }


def _bound(
    kernel: Callable[..., None],
    points: Floats,
    positions: Floats,
    arrays: tuple[npt.NDArray[Any], ...],
    sizes: tuple[int, ...],
) -> Callable[[], Floats]:
    """Return a kernel's call with its memory allocated; sizes: of its scratch arrays."""
    contiguous = tuple(np.ascontiguousarray(array) for array in arrays)
    (controls, samples), width = contiguous[0].shape, contiguous[-1].shape[-1]
    scratch = tuple(np.zeros(size) for size in (samples + 1 + controls, *sizes))
    out = np.zeros((len(points), width))

    def answer() -> Floats:
        kernel(points, positions, contiguous, scratch, out)
        return out

    return answer


def lu_factors(systems: Floats) -> tuple[Floats, Floats, Floats]:
    """Return LU factors by columns (T, m, m), row orders (T, m), reciprocal diagonals (T, m)."""
    columns, orders = [], []
    for system in systems:
        factors, swaps = linalg.lu_factor(system)
        order = np.arange(len(swaps))
        for row, other in enumerate(swaps):
            order[[row, other]] = order[[other, row]]
        columns.append(factors.T)
        orders.append(order)
    stacked = np.stack(columns)
    return stacked, np.stack(orders), 1.0 / np.diagonal(stacked, axis1=1, axis2=2)


def system(field: UniversalKriging) -> Floats:
    """Return the kriging system (m, m) of one frame with linear drift."""
    n, drift = len(field.samples), np.insert(field.samples, 0, 1.0, axis=1)
    near = kriging_model.covariances(field.hyper, field.samples, field.samples)
    corner = np.zeros((drift.shape[1], drift.shape[1]))
    return np.block([[near + field.hyper.nugget * np.eye(n), drift], [drift.T, corner]])
