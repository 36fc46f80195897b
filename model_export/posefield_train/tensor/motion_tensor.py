"""Motion tensor of degrees of freedom × frames × samples (Mukai & Kuriyama 2006, section 2).

It is expressed in a metric of joint positions, see `metric`.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.errors import TrainingError
from posefield.common.units import (
    Booleans,
    ClipBones,
    ClipPaths,
    ClipRotations,
    ClipTravel,
    Floats,
    JointWeights,
    PoseVectors,
    Rotations,
)
from posefield.motion import curves, quat, skeleton
from posefield.motion.clip import Clip
from posefield.motion.curves import Curve, distances
from posefield.motion.quat import CHARTS
from posefield_train.align import time_alignment, travel
from posefield_train.align.time_alignment import AlignedClips
from posefield_train.align.warp import CanonicalTiming
from posefield_train.source import canonical
from posefield_train.source.canonical import Finding
from posefield_train.tensor import pose_vectors as chart
from posefield_train.tensor.pose_vectors import PoseChart

# Radius of a sphere at every joint, m, so that rotations about a bone have a cost.
SHELL_RADIUS = 0.03
# Poses over which the metric is averaged: 40 times as many change the truncation error by less than
# half a percent, on the procedural family and on real motion.
SAMPLED_POSES = 50
# Least eigenvalue of the metric, as a share of the largest.
FLOOR = 1e-6


def gram(
    parents: tuple[int, ...],
    rotations: Annotated[Floats, "poses joints 4"],
    jacobians: Annotated[Floats, "poses joints 3 3"],
    translations: Annotated[Floats, "poses joints 3"],
    joint_weights: JointWeights,
) -> Annotated[Floats, "3+joints*3 3+joints*3"]:
    """Return the mean over poses of JᵀJ (D, D), D = 3 + 3 J, in m² per squared unit.

    rotations: local (P, J, 4). jacobians: right Jacobians (P, J, 3, 3) of their numbers.
    translations: local (P, J, 3), m. joint_weights: mass (J,) of each joint.
    """
    positions, orientations = skeleton.forward_kinematics(parents, rotations, translations)
    below = skeleton.descendant_matrix(parents)
    motions = _motions(positions, np.swapaxes(quat.to_matrix(orientations) @ jacobians, -1, -2))
    forces = _forces(motions, positions, joint_weights, below)
    poses = len(positions)
    products = np.tensordot(motions, forces, axes=([0, 2], [0, 2])) / poses
    # A force acts on its own joint and on ancestors; the other half follows by symmetry.
    acts = np.kron(np.pad(below, ((1, 0), (1, 0)), constant_values=1.0), np.ones((3, 3)))
    upper = products * np.triu(acts)
    return upper + np.triu(upper, k=1).T


def _motions(
    positions: Annotated[Floats, "poses joints 3"], axes: Annotated[Floats, "poses joints 3 3"]
) -> Annotated[Floats, "poses 3+joints*3 6"]:
    """Return the motion (P, 3 + 3 J, 6) of each degree of freedom.

    It is the angular velocity and the velocity at the origin.
    """
    poses, joints = positions.shape[:2]
    motions = np.zeros((poses, 3 + 3 * joints, 6))
    motions[:, :3, 3:] = np.eye(3)
    motions[:, 3:, :3] = axes.reshape(poses, -1, 3)
    motions[:, 3:, 3:] = quat.cross(positions[:, :, None], axes).reshape(poses, -1, 3)
    return motions


def _forces(
    motions: Annotated[Floats, "poses dof 6"],
    positions: Annotated[Floats, "poses joints 3"],
    mass: JointWeights,
    below: Annotated[Floats, "joints joints"],
) -> Annotated[Floats, "poses dof 6"]:
    """Return the moment about the origin and the force (P, 3 + 3 J, 6) that each motion needs.

    The joint and its descendants move as one rigid body.
    """
    moments = mass[:, None] * positions
    second = moments[..., :, None] * positions[..., None, :]
    size = np.trace(second, axis1=-2, axis2=-1) + 2.0 / 3.0 * SHELL_RADIUS**2 * mass
    inertia = size[..., None, None] * np.eye(3) - second
    carried = np.vstack([below[:1], below])
    mass_below = np.repeat(carried @ mass, 3)[:, None]
    first = np.repeat(np.einsum("jk,pkc->pjc", carried, moments), 3, axis=1)
    turning = np.repeat(np.einsum("jk,pkcd->pjcd", carried, inertia, optimize=True), 3, axis=1)
    spin, drift = motions[..., :3], motions[..., 3:]
    force = quat.cross(spin, first) + mass_below * drift
    moment = np.einsum("pdcx,pdx->pdc", turning, spin) + quat.cross(first, drift)
    return np.concatenate([moment, force], axis=-1)


def whitening(
    gram: Annotated[Floats, "dof dof"],
) -> tuple[Annotated[Floats, "dof dof"], Annotated[Floats, "dof dof"]]:
    """Return the square root (D, D) of a Gram matrix and its inverse.

    Eigenvalues below FLOOR times the largest are raised to it.
    """
    if not len(gram):
        return gram, gram
    values, vectors = np.linalg.eigh(gram)
    roots = np.sqrt(np.maximum(values, FLOOR * values[-1]))
    return (vectors * roots) @ vectors.T, (vectors / roots) @ vectors.T


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
    aligned: AlignedClips, parents: tuple[int, ...], offsets: ClipBones, hinged: bool = False
) -> tuple[PoseVectors, PoseChart, list[Finding]]:
    """Return pose vectors (N, T, D) of aligned clips, their chart, and flips and far joints.

    offsets: bone offsets (N, J, 3) of each clip's performer, m. hinged: whether the joints are a
    robot's hinges, whose angles are linear in the numbers.
    """
    small = canonical.small_joints(parents, offsets.mean(axis=0))
    rotations, flipped = canonical.remove_flips(aligned.rotations, small)
    own_chart, far = chart.fit_chart(rotations, linear=hinged)
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
    root, inverse = whitening(gram[np.ix_(moves, moves)])
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
        centred = numbers[rows]
        flat = whiten @ centred.reshape(len(centred) * frames, -1).T
        flat -= (whiten @ mean)[:, None]
        values[:, :, rows] = flat.reshape(-1, len(centred), frames).swapaxes(1, 2)
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
    chosen = np.unique(np.linspace(0, samples * frames - 1, SAMPLED_POSES).astype(np.int64))
    some = numbers.reshape(samples * frames, -1)[chosen]
    rotations, root = own_chart.poses(some)
    translations = offsets[chosen // frames].copy()
    translations[:, 0] = root
    turns = some[:, own_chart.joint_numbers].reshape(len(some), -1, 3)
    jacobians = CHARTS[own_chart.chart].right_jacobian(turns)
    return gram(parents, rotations, jacobians, translations, joint_weights)


FRAMES = 60
UNIFORM_SHARES = np.linspace(0.0, 1.0, FRAMES)


@dataclass(frozen=True)
class UniformPoses:
    """Poses of predicted motions at uniform times.

    rotations: (N, FRAMES, J, 4). path: root positions (N, FRAMES, 3), m. curves: values (N, FRAMES,
    C), clamped to their limits.
    """

    rotations: ClipRotations
    path: ClipPaths
    curves: Annotated[Floats, "clips frames curves"]


def captured_poses(clip: Clip) -> tuple[Rotations, Annotated[Floats, "frames joints 3"]]:
    """Return rotations (FRAMES, J, 4) and translations (FRAMES, J, 3), m, of a captured clip."""
    rotations, path = time_alignment.resample(clip, UNIFORM_SHARES)
    return rotations, skeleton.translations(clip.translations.mean(axis=0), path)


def predicted_poses(
    timing: CanonicalTiming,
    tensor: MotionTensor,
    numbers: Annotated[Floats, "clips canonical dof"],
    logs: Annotated[Floats, "clips knots"],
    travels: ClipTravel | None,
) -> UniformPoses:
    """Return the poses of predicted pose vectors (N, T, D) on canonical time.

    logs: log increments (N, knots) of their warps. travels: (N, 3) of cycles.
    """
    steps = np.tile(UNIFORM_SHARES, (len(numbers), 1))
    _, frames = timing.numpy(np.zeros((len(steps), 1)), logs, steps)
    share = frames / (timing.frames - 1)
    pairs = zip(numbers, share, strict=True)
    resampled = np.stack([time_alignment.interpolate(*pair) for pair in pairs])
    rotations, path = tensor.chart.poses(resampled)
    if travels is not None:
        rotations, path = travel.put_back(rotations, path, travels, share)
    values = curves.clamp(tensor.curves, resampled[..., tensor.chart.curve_numbers])
    return UniformPoses(rotations, path, values)
