"""Motion tensor of degrees of freedom × frames × samples (Mukai & Kuriyama 2006, section 2).

It is expressed in a metric of joint positions, see `metric`.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import ClipBones, JointWeights, PoseVectors
from posefield.common.errors import TrainingError
from posefield.common.units import Booleans, Floats
from posefield.motion.curves import Curve, distances
from posefield.motion.rotation_charts import CHARTS
from posefield_train.align.time_alignment import AlignedClips
from posefield_train.source import canonical
from posefield_train.source.canonical import Finding
from posefield_train.tensor import pose_metric
from posefield_train.tensor import pose_vectors as chart
from posefield_train.tensor.pose_vectors import PoseChart

# A degree of freedom with a smaller range over the family is left out, m or rad.
CONSTANT_RANGE = 1e-9


@dataclass(frozen=True)
class MotionTensor:
    """Centred, whitened pose vectors of aligned clips.

    values: (D', T, N), of the D' degrees of freedom that vary. A unit of squared distance between
    two entries is a square metre, summed over weighted joints and frames. mean: pose vector (D,) on
    which it is centred. whiten, unwhiten: maps (D', D) and (D, D') to whitened values and back.
    weight: sum of the joints' weights, and one for each curve. curves: of the family.
    """

    values: Annotated[Floats, "varying frames clips"]
    mean: Annotated[Floats, "dof"]
    whiten: Annotated[Floats, "varying dof"]
    unwhiten: Annotated[Floats, "dof varying"]
    chart: PoseChart
    weight: float
    curves: tuple[Curve, ...] = ()

    def numbers(self, values: Annotated[Floats, "varying frames clips"]) -> PoseVectors:
        """Return pose vectors (B, T, D) of slices (D', T, B) of the tensor."""
        return self.mean + values.transpose(2, 1, 0) @ self.unwhiten.T

    def rms(self, squared: Annotated[Floats, "*batch"]) -> Annotated[Floats, "*batch"]:
        """Return the RMS joint distance, m, of squared distances summed over the tensor."""
        _, frames, samples = self.values.shape
        return np.sqrt(squared / (self.weight * frames * samples))


def pose_vectors(
    aligned: AlignedClips, parents: tuple[int, ...], offsets: ClipBones
) -> tuple[PoseVectors, PoseChart, list[Finding]]:
    """Return pose vectors (N, T, D) of aligned clips, their chart, and flips and far joints.

    offsets: bone offsets (N, J, 3) of each clip's performer, m.
    """
    small = canonical.small_joints(parents, offsets.mean(axis=0))
    rotations, flipped = canonical.remove_flips(aligned.rotations, small)
    own_chart, far = chart.fit_chart(rotations)
    numbers = own_chart.numbers(rotations, aligned.root_path)
    if aligned.curves is not None:
        numbers = np.concatenate([numbers, aligned.curves], axis=-1)
    return numbers, own_chart, flipped + far


def build_tensor(
    numbers: PoseVectors,
    own_chart: PoseChart,
    parents: tuple[int, ...],
    offsets: ClipBones,
    joint_weights: JointWeights,
    curves: tuple[Curve, ...] = (),
) -> MotionTensor:
    """Return the tensor of pose vectors (N, T, D) in the metric of their own poses.

    offsets: bone offsets (N, J, 3) of each clip's performer, m. joint_weights: (J,). curves: those
    of the last numbers of the pose vectors; each counts as a joint of weight one. Raises
    TrainingError if nothing varies.
    """
    mean = numbers.mean(axis=(0, 1))
    varies = np.ptp(numbers.reshape(-1, len(mean)), axis=0) > CONSTANT_RANGE
    if not varies.any():
        raise TrainingError("found no joint and no curve that moves, expected motion in some clip")
    own_gram = sampled_gram(numbers, own_chart, parents, offsets, joint_weights)
    root, inverse = metric_roots(own_gram, curves, varies)
    whiten, unwhiten = np.zeros((2, len(root), len(mean)))
    whiten[:, varies], unwhiten[:, varies] = root, inverse
    values = _whiten(numbers, mean, whiten)
    weight = float(joint_weights.sum()) + len(curves)
    return MotionTensor(values, mean, whiten, unwhiten.T, own_chart, weight, curves)


def metric_roots(
    gram: Annotated[Floats, "freedoms freedoms"],
    curves: tuple[Curve, ...],
    varies: Annotated[Booleans, "dof"],
) -> tuple[Annotated[Floats, "varying varying"], Annotated[Floats, "varying varying"]]:
    """Return the square root (D', D') of the metric and its inverse, of numbers that vary.

    gram: of the joints (3 + 3 J, 3 + 3 J). curves: of the last numbers. varies: mask (D,).
    """
    moves = varies[: len(gram)]
    root, inverse = pose_metric.whitening(gram[np.ix_(moves, moves)])
    # Curves are no part of the body, so their metric is diagonal.
    units = distances(curves)[varies[len(gram) :]]
    return (
        _block_diagonal(root, np.diag(units)),
        _block_diagonal(inverse, np.diag(1.0 / units)),
    )


def _block_diagonal(
    a: Annotated[Floats, "some some"], b: Annotated[Floats, "others others"]
) -> Annotated[Floats, "varying varying"]:
    return np.block([[a, np.zeros((len(a), len(b)))], [np.zeros((len(b), len(a))), b]])


def _whiten(
    numbers: PoseVectors, mean: Annotated[Floats, "dof"], whiten: Annotated[Floats, "varying dof"]
) -> Annotated[Floats, "varying frames clips"]:
    """Return the tensor (D', T, N) of pose vectors (N, T, D), transposed in small blocks."""
    samples, frames, _ = numbers.shape
    values = np.empty((len(whiten), frames, samples))
    for rows in canonical.clip_blocks(samples):
        own = numbers[rows]
        flat = whiten @ own.reshape(len(own) * frames, -1).T
        flat -= (whiten @ mean)[:, None]
        values[:, :, rows] = flat.reshape(-1, len(own), frames).swapaxes(1, 2)
    return values


def sampled_gram(
    numbers: PoseVectors,
    own_chart: PoseChart,
    parents: tuple[int, ...],
    offsets: ClipBones,
    joint_weights: JointWeights,
) -> Annotated[Floats, "freedoms freedoms"]:
    """Return the mean Gram matrix (3 + 3 J, 3 + 3 J) of evenly spaced pose vectors (N, T, D)."""
    samples, frames, _ = numbers.shape
    chosen = np.unique(
        np.linspace(0, samples * frames - 1, pose_metric.SAMPLED_POSES).astype(np.int64)
    )
    some = numbers.reshape(samples * frames, -1)[chosen]
    rotations, root = own_chart.poses(some)
    translations = offsets[chosen // frames].copy()
    translations[:, 0] = root
    turns = some[:, own_chart.joint_numbers].reshape(len(some), -1, 3)
    jacobians = CHARTS[own_chart.chart].right_jacobian(turns)
    return pose_metric.gram(parents, rotations, jacobians, translations, joint_weights)
