"""Leave-one-out errors of whole motions, compared with the captured ones after time warping.

Residuals on canonical time also count differences in timing, which a comparison of motions does
not: they would make sigma too large where clips differ mostly in timing.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from posefield.common.units import Floats
from posefield.motion import curves, skeleton
from posefield.motion.curves import Curve
from posefield_train.align import dtw, time_alignment, travel
from posefield_train.align.canonical_timing import CanonicalTiming
from posefield_train.source.ingest import Example
from posefield_train.tensor.decoder import Proportions
from posefield_train.tensor.motion_tensor import MotionTensor

FRAMES = 60
UNIFORM_SHARES = np.linspace(0.0, 1.0, FRAMES)


def mean_squared_errors(captured: Floats, predicted: Floats, curves: int = 0) -> Floats:
    """Return the mean squared joint distances (N,), m², after time warping.

    captured, predicted: joint positions (N, FRAMES, J, 3), m; the last `curves` points are those of
    curves. Motions are warped by their positions relative to the root, and compared with it.
    """
    phases = dtw.warp(_features(captured, curves), _features(predicted, curves))
    pairs = zip(predicted.reshape(*predicted.shape[:2], -1), phases, strict=True)
    warped = np.stack([time_alignment.interpolate(*pair) for pair in pairs])
    squares = np.sum(np.square(warped.reshape(captured.shape) - captured), axis=-1)
    return np.asarray(np.mean(squares, axis=(1, 2)))


def _features(positions: Floats, curves: int) -> Floats:
    joints = positions.shape[2] - curves
    relative = positions.copy()
    relative[:, :, :joints] -= positions[:, :, :1]
    return relative.reshape(*positions.shape[:2], -1)


def captured_positions(examples: Sequence[Example]) -> Floats:
    """Return joint positions (N, FRAMES, J, 3), m, of captured clips at uniform times.

    Points of the curves follow those of the joints.
    """
    found = []
    for example in examples:
        rotations, path = time_alignment.resample(example.clip, UNIFORM_SHARES)
        translations = skeleton.translations(example.clip.translations.mean(axis=0), path)
        own = skeleton.positions(example.clip.skeleton.parents, rotations, translations)
        found.append(_with_curves(own, *_uniform_curves(example)))
    return np.stack(found)


def _uniform_curves(example: Example) -> tuple[tuple[Curve, ...], Floats]:
    clip = example.clip
    values = time_alignment.interpolate(clip.curve_values, UNIFORM_SHARES)
    return clip.curves.curves if clip.curves else (), values


def _with_curves(joints: Floats, own: tuple[Curve, ...], values: Floats) -> Floats:
    """Return positions (..., J, 3) with the points of curves of values (..., C) behind them."""
    return np.concatenate([joints, curves.as_points(own, values)], axis=-2) if own else joints


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
    steps = np.tile(UNIFORM_SHARES, (slices.shape[2], 1))
    _, place = timing.numpy(np.zeros((len(steps), 1)), values["warp"], steps)
    share = place / (timing.frames - 1)
    pairs = zip(tensor.numbers(slices), share, strict=True)
    numbers = np.stack([time_alignment.interpolate(*pair) for pair in pairs])
    rotations, path = tensor.chart.poses(numbers)
    if "travel" in values:
        rotations, path = travel.put_back(rotations, path, values["travel"], share)
    offsets = proportions.numpy(values["offsets"])
    joints = skeleton.positions(parents, rotations, skeleton.translations(offsets, path))
    values_of_curves = curves.clamp(tensor.curves, numbers[..., tensor.chart.curve_numbers])
    return _with_curves(joints, tensor.curves, values_of_curves)
