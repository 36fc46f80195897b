"""Noise-free motions of the procedural family at control points that were not sampled."""

from collections.abc import Sequence

import numpy as np

from posefield.common.units import Floats
from posefield_train.evaluate import motion_errors
from posefield_train.evaluate.motion_errors import ComparedMotion, MotionEvent
from posefield_train.sample import noise_free, sample_controls

POINTS, SEED = 2_000, 2006
RATE = 120.0
"""Frames per second of the noise-free motions."""


def truth_points(count: int = POINTS) -> Floats:
    """Return control points (count, 4), seeded, spread evenly over the possible range."""
    rng = np.random.Generator(np.random.PCG64(SEED))
    return np.array([_point(rng) for _ in range(count)])


def _point(rng: np.random.Generator) -> list[float]:
    stature = rng.uniform(*sample_controls.RANGES["stature"][:2])
    hip = rng.uniform(*sample_controls.limits("hip_height", stature, 0.0))
    rest = [
        rng.uniform(*sample_controls.limits(n, stature, hip)) for n in ("turn", "target_height")
    ]
    return [float(stature), float(hip), *map(float, rest)]


def truth_motions(truth_points: Floats, event: MotionEvent | None) -> Sequence[ComparedMotion]:
    """Return the noise-free motions at control points (Q, 4)."""
    return [
        motion_errors.motion_of_clip(noise_free.truth_clip(list(point), RATE), event)
        for point in truth_points
    ]
