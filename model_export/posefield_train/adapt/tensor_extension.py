"""Extension of a model's tensor by new clips.

The existing samples are taken from the model in reduced form. The residuals of the new clips add
columns to the bases of degrees of freedom and frames, as few as keep the remaining error within the
truncation error that the model allows.
"""

from dataclasses import dataclass

import numpy as np

from posefield.common.units import Floats
from posefield_train.graph.float_model import FloatModel
from posefield_train.tensor import hosvd, motion_tensor
from posefield_train.tensor.decoder import Decoder
from posefield_train.tensor.hosvd import TuckerTensor
from posefield_train.tensor.motion_tensor import CONSTANT_RANGE, MotionTensor

# Error allowed for a model that was not truncated, m: invisible.
MINIMUM_NORM = 1e-4


@dataclass(frozen=True)
class ExtendedTensor:
    """The motion tensor of existing samples followed by new clips.

    full: its decomposition at full rank. ranks: those that keep all of it.
    """

    tensor: MotionTensor
    full: TuckerTensor
    ranks: tuple[int, int, int]


@dataclass(frozen=True)
class _PoseSpace:
    """Metric of the model's poses, and a basis of its degrees of freedom.

    varies: mask (D,) of numbers that vary, those of curves included. root, inverse: (D', D'), to
    the metric's coordinates and back. directions: orthonormal (D', r1). turn: (r1, r1), from the
    core's coordinates to those of the directions.
    """

    varies: Floats
    root: Floats
    inverse: Floats
    directions: Floats
    turn: Floats


def extend(
    model: FloatModel,
    parents: tuple[int, ...],
    joint_weights: Floats,
    numbers: Floats,
    allowed: float,
) -> ExtendedTensor:
    """Return the tensor of a model's samples and new pose vectors (k, T, D).

    joint_weights: (J,). allowed: root mean square error, m, that truncation may add.
    """
    decoder = model.decoder
    weight = float(joint_weights.sum()) + len(decoder.curves)
    old = _reduced(decoder)
    space = _pose_space(model, parents, joint_weights, numbers, old)
    centred = (numbers - decoder.mean)[..., space.varies] @ space.root
    # Each of the two modes gets half of the squared error.
    clips, frames = numbers.shape[:2]
    budget = max(allowed, MINIMUM_NORM) ** 2 * weight * clips * frames / 2.0
    directions = _extra_directions(space.directions, centred, budget)
    coordinates = (centred @ directions).swapaxes(1, 2)
    times = np.linalg.qr(decoder.reduced.bases[1])[0]
    longer = _extra_directions(times, coordinates, budget)
    new = (coordinates @ longer @ longer.T).transpose(1, 2, 0)
    turned = hosvd.mode_dot(old, space.turn, 0)
    turned = np.pad(turned, ((0, len(new) - len(turned)), (0, 0), (0, 0)))
    whole = _tensor(np.concatenate([turned, new], axis=2), space, directions, decoder, weight)
    full = hosvd.decompose(whole.values)
    samples = min(decoder.reduced.core.shape[2] + clips, full.core.shape[2])
    return ExtendedTensor(whole, full, (len(new), longer.shape[1], samples))


def _reduced(decoder: Decoder) -> Floats:
    """Return motions (r1, T, n) of the samples in the coordinates of the first mode."""
    core, (_, times, samples) = decoder.reduced.core, decoder.reduced.bases
    return hosvd.mode_dot(hosvd.mode_dot(core, times, 1), samples, 2)


def _pose_space(
    model: FloatModel,
    parents: tuple[int, ...],
    joint_weights: Floats,
    numbers: Floats,
    old: Floats,
) -> _PoseSpace:
    decoder, own_chart = model.decoder, model.decoder.chart
    known = decoder.mean + old.transpose(2, 1, 0) @ decoder.directions
    offsets = model.proportions.numpy(model.bank.sample_values("offsets"))
    gram = motion_tensor.sampled_gram(known, own_chart, parents, offsets, joint_weights)
    moves = np.ptp(numbers.reshape(-1, numbers.shape[-1]), axis=0) > CONSTANT_RANGE
    varies = moves | np.any(decoder.directions != 0.0, axis=0)
    root, inverse = motion_tensor.metric_roots(gram, decoder.curves, varies)
    mixed = (decoder.directions[:, varies] @ root).T
    directions = hosvd.fix_signs(np.linalg.qr(mixed)[0])
    return _PoseSpace(varies, root, inverse, directions, directions.T @ mixed)


def _extra_directions(basis: Floats, rows: Floats, budget: float) -> Floats:
    """Extend an orthonormal basis (D, r) by the fewest columns that fit rows (..., D).

    budget: largest squared distance of the rows from the extended basis.
    """
    flat = rows.reshape(-1, rows.shape[-1])
    left = flat - flat @ basis @ basis.T
    values, vectors = np.linalg.eigh(left.T @ left)
    kept = np.count_nonzero(np.cumsum(np.maximum(values, 0.0)) > budget)
    found = vectors[:, len(values) - kept :]
    # Rounding leaves components along the old columns; remove them.
    found, _ = np.linalg.qr(found - basis @ (basis.T @ found))
    return np.hstack([basis, hosvd.fix_signs(found)])


def _tensor(
    values: Floats, space: _PoseSpace, directions: Floats, decoder: Decoder, weight: float
) -> MotionTensor:
    whiten, unwhiten = np.zeros((2, len(values), len(decoder.mean)))
    whiten[:, space.varies] = directions.T @ space.root
    unwhiten[:, space.varies] = directions.T @ space.inverse
    own_chart, own_curves = decoder.chart, decoder.curves
    return MotionTensor(values, decoder.mean, whiten, unwhiten.T, own_chart, weight, own_curves)
