"""Leave-one-out errors of whole motions, compared with the captured ones after time warping.

Residuals on canonical time also count differences in timing, which a comparison of motions does
not: they would make sigma too large where clips differ mostly in timing.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from posefield.common.units import Floats
from posefield.motion import curves, skeleton
from posefield.motion.curves import Curve
from posefield_train.align import dtw, time_alignment
from posefield_train.align.warp import CanonicalTiming
from posefield_train.source.ingest import Example
from posefield_train.tensor import motion_tensor
from posefield_train.tensor.decoder import Proportions
from posefield_train.tensor.motion_tensor import UNIFORM_SHARES, MotionTensor


def compare(captured: Floats, predicted: Floats, curve_count: int = 0) -> Floats:
    """Return mean squared joint distances after time warping, m², and accelerations (N, 3).

    The accelerations are those of predicted and of captured joints relative to the root, in metres
    for a step of time each. captured, predicted: joint positions (N, FRAMES, J, 3), m; the last
    `curve_count` points are those of curves. Motions are warped by their positions relative to the
    root, and compared with it.
    """
    phases = dtw.warp(_features(captured, curve_count), _features(predicted, curve_count))
    pairs = zip(predicted.reshape(*predicted.shape[:2], -1), phases, strict=True)
    warped = np.stack([time_alignment.interpolate(*pair) for pair in pairs])
    squares = np.sum(np.square(warped.reshape(captured.shape) - captured), axis=-1)
    accelerations = (_accelerations(one, curve_count) for one in (predicted, captured))
    return np.stack([np.mean(squares, axis=(1, 2)), *accelerations], axis=1)


def _accelerations(positions: Floats, curve_count: int) -> Floats:
    joints = positions[:, :, 1 : positions.shape[2] - curve_count] - positions[:, :, :1]
    if not joints.shape[2]:
        return np.zeros(len(positions))
    return np.linalg.norm(np.diff(joints, n=2, axis=1), axis=-1).mean(axis=(1, 2))


def _features(positions: Floats, curve_count: int) -> Floats:
    joints = positions.shape[2] - curve_count
    relative = positions.copy()
    relative[:, :, :joints] -= positions[:, :, :1]
    return relative.reshape(*positions.shape[:2], -1)


def captured_positions(examples: Sequence[Example]) -> Floats:
    """Return joint positions (N, FRAMES, J, 3), m, of captured clips at uniform times.

    Points of the curves follow those of the joints.
    """
    points = []
    for example in examples:
        poses = motion_tensor.captured_poses(example.clip)
        joints = skeleton.positions(example.clip.skeleton.parents, *poses)
        clip = example.clip
        values = time_alignment.interpolate(clip.curve_values, UNIFORM_SHARES)
        points.append(_with_curves(joints, clip.curves.curves if clip.curves else (), values))
    return np.stack(points)


def _with_curves(joints: Floats, curves_of_family: tuple[Curve, ...], values: Floats) -> Floats:
    """Return positions (..., J, 3) with the points of curves of values (..., C) behind them."""
    return (
        np.concatenate([joints, curves.as_points(curves_of_family, values)], axis=-2)
        if curves_of_family
        else joints
    )


def predicted_positions(
    timing: CanonicalTiming,
    tensor: MotionTensor,
    proportions: Proportions,
    slices: Floats,
    values: Mapping[str, Floats],
    parents: tuple[int, ...],
) -> Floats:
    """Return joint positions (N, FRAMES, J, 3), m, of predicted motions at uniform times.

    slices: of the whitened tensor (D', T, N). values: of the other quantities by name. Points of
    the curves follow those of the joints.
    """
    poses = motion_tensor.predicted_poses(
        timing, tensor, tensor.numbers(slices), values["warp"], values.get("travel")
    )
    translations = skeleton.translations(proportions.numpy(values["offsets"]), poses.path)
    joints = skeleton.positions(parents, poses.rotations, translations)
    return _with_curves(joints, tensor.curves, poses.curves)
