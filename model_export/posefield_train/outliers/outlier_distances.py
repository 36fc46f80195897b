"""Outlier detection: distances of a family's clips from their leave-one-out predictions.

Detected outliers are excluded from the predictions of the other clips.
"""

from dataclasses import dataclass

import numpy as np

from posefield.common.units import Floats, Indices
from posefield_train.kriging import sample_kriging, universal_kriging
from posefield_train.kriging.sample_points import SamplePoints
from posefield_train.kriging.universal_kriging import Hyper

# A clip is an outlier if its distance, in kriging deviations, exceeds the median by the factor
# TIMES and by DEVIATIONS robust standard deviations. On three real families and the procedural one
# no clip exceeds 2.7 and 5.6.
MEDIAN_FACTOR, DEVIATIONS = 3.0, 6.0
# Largest share of a family that can be outliers.
MAX_OUTLIER_SHARE = 0.25
# Ratio of a robust standard deviation to the median absolute deviation.
MAD_TO_SIGMA = 1.4826


@dataclass(frozen=True)
class OutlierDistances:
    """Leave-one-out distances of a family with its outliers excluded.

    left_out: maps values to leave-one-out residuals (N, N), without contributions of outliers.
    distances: of whole motions (N,), m. times: distances (N,) relative to the median, both in units
    of the kriging deviation. outside: outliers, the farthest first.
    """

    left_out: Floats
    distances: Floats
    times: Floats
    outside: tuple[int, ...]

    @property
    def usual(self) -> float:
        """Return the median distance of the clips that are not outliers, m."""
        return float(np.median(np.delete(self.distances, self.outside)))


def measure_outliers(hyper: Hyper, laid: SamplePoints, motions: Floats) -> OutlierDistances:
    """Return the outliers of motions (N, m), whose differences are distances, m.

    The farthest outlier is excluded before the next is searched, because it spoils the predictions
    of its neighbours.
    """
    outside: list[int] = []
    judged = _measure(hyper, laid, motions, outside)
    while len(outside) < MAX_OUTLIER_SHARE * len(motions):
        times = judged.times.copy()
        times[outside] = 0.0
        worst = int(np.argmax(times))
        if (
            times[worst] < MEDIAN_FACTOR
            or robust_deviations(np.delete(times, outside)).max() < DEVIATIONS
        ):
            break
        outside.append(worst)
        judged = _measure(hyper, laid, motions, outside)
    return judged


def robust_deviations(values: Floats) -> Floats:
    """Return values (N,) as robust standard deviations from their median."""
    gaps = values - np.median(values)
    spread = MAD_TO_SIGMA * float(np.median(np.abs(gaps)))
    # The spread is zero if most values are equal; any difference is then an outlier.
    return gaps / max(spread, 1e-12)


def _measure(
    hyper: Hyper, laid: SamplePoints, motions: Floats, outside: list[int]
) -> OutlierDistances:
    kept = np.delete(np.arange(len(motions)), outside)
    left_out = np.zeros((len(motions), len(motions)))
    left_out[np.ix_(kept, kept)] = _left_out(hyper, laid, kept)
    for clip in outside:
        with_it = np.append(kept, clip)
        left_out[clip, with_it] = _left_out(hyper, laid, with_it)[-1]
    distances = np.linalg.norm(left_out @ motions, axis=1)
    times = distances / np.sqrt(universal_kriging.left_out_variances(hyper, laid.points, left_out))
    return OutlierDistances(left_out, distances, times / np.median(times[kept]), tuple(outside))


def _left_out(hyper: Hyper, laid: SamplePoints, kept: Indices) -> Floats:
    return sample_kriging.leave_out(hyper, laid, kept)
