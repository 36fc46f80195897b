"""Motions at uniform times, captured and predicted, whatever their duration."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import ClipPaths, ClipRotations, ClipTravel, Rotations
from posefield.common.units import Floats
from posefield.motion import curves, skeleton
from posefield.motion.clip import Clip
from posefield_train.align import time_alignment, travel
from posefield_train.align.canonical_timing import CanonicalTiming
from posefield_train.tensor.motion_tensor import MotionTensor

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
    _, place = timing.numpy(np.zeros((len(steps), 1)), logs, steps)
    share = place / (timing.frames - 1)
    pairs = zip(numbers, share, strict=True)
    found = np.stack([time_alignment.interpolate(*pair) for pair in pairs])
    rotations, path = tensor.chart.poses(found)
    if travels is not None:
        rotations, path = travel.put_back(rotations, path, travels, share)
    own = curves.clamp(tensor.curves, found[..., tensor.chart.curve_numbers])
    return UniformPoses(rotations, path, own)
