"""Leave-one-out errors of whole motions, compared with the captured ones after time warping.

Residuals on canonical time also count differences in timing, which a comparison of motions does
not: they would make sigma too large where clips differ mostly in timing.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from posefield.common.units import Floats
from posefield.motion import skeleton
from posefield_train.align import dtw, time_alignment, travel
from posefield_train.align.canonical_timing import CanonicalTiming
from posefield_train.source.ingest import Example
from posefield_train.tensor.decoder import Proportions
from posefield_train.tensor.motion_tensor import MotionTensor

FRAMES = 60
UNIFORM_SHARES = np.linspace(0.0, 1.0, FRAMES)


def mean_squared_errors(captured: Floats, predicted: Floats) -> Floats:
    """Return the mean squared joint distances (N,), m², after time warping.

    captured, predicted: joint positions (N, FRAMES, J, 3), m. Motions are warped by their positions
    relative to the root, and compared with it.
    """
    phases = dtw.warp(_features(captured), _features(predicted))
    pairs = zip(predicted.reshape(*predicted.shape[:2], -1), phases, strict=True)
    warped = np.stack([time_alignment.interpolate(*pair) for pair in pairs])
    squares = np.sum(np.square(warped.reshape(captured.shape) - captured), axis=-1)
    return np.asarray(np.mean(squares, axis=(1, 2)))


def _features(positions: Floats) -> Floats:
    return (positions - positions[:, :, :1]).reshape(*positions.shape[:2], -1)


def captured_positions(examples: Sequence[Example]) -> Floats:
    """Return joint positions (N, FRAMES, J, 3), m, of captured clips at uniform times."""
    found = []
    for example in examples:
        rotations, path = time_alignment.resample(example.clip, UNIFORM_SHARES)
        translations = skeleton.translations(example.clip.translations.mean(axis=0), path)
        found.append(skeleton.positions(example.clip.skeleton.parents, rotations, translations))
    return np.stack(found)


def predicted_positions(
    timing: CanonicalTiming,
    tensor: MotionTensor,
    proportions: Proportions,
    slices: Floats,
    values: Mapping[str, Floats],
    parents: tuple[int, ...],
) -> Floats:
    """Return joint positions (N, FRAMES, J, 3), m, of predicted motions at uniform times.

    slices: of the whitened tensor (D', T, N). values: of the other quantities by name.
    """
    steps = np.tile(UNIFORM_SHARES, (slices.shape[2], 1))
    _, place = timing.numpy(np.zeros((len(steps), 1)), values["warp"], steps)
    share = place / (timing.frames - 1)
    pairs = zip(tensor.numbers(slices), share, strict=True)
    rotations, path = tensor.chart.poses(
        np.stack([time_alignment.interpolate(*pair) for pair in pairs])
    )
    if "travel" in values:
        rotations, path = travel.put_back(rotations, path, values["travel"], share)
    offsets = proportions.numpy(values["offsets"])
    return skeleton.positions(parents, rotations, skeleton.translations(offsets, path))
