"""The procedural family against the truth that it is made from."""

import numpy as np

from model_export.sample import controls
from service.motion.conventions import Floats

POINTS, SEED = 2_000, 2006


def points(count: int = POINTS) -> Floats:
    """Control points (count, 4) spread evenly over what the bodies can do, none of them sampled."""
    rng = np.random.Generator(np.random.PCG64(SEED))
    return np.array([_point(rng) for _ in range(count)])


def _point(rng: np.random.Generator) -> list[float]:
    stature = rng.uniform(*controls.RANGES["stature"][:2])
    hip = rng.uniform(*controls.limits("hip_height", stature, 0.0))
    rest = [rng.uniform(*controls.limits(n, stature, hip)) for n in ("turn", "target_height")]
    return [float(stature), float(hip), *map(float, rest)]
