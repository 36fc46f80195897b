"""Prediction of motions of takes that are left out, from measures of the other takes' clips.

Motions are predicted by kriging with fixed scales, whose leave-one-take-out residuals have a closed
form (Dubrule, Mathematical Geology, 1983).
"""

from collections.abc import Sequence

import numpy as np

from posefield.common.units import Floats
from posefield.motion.measures import MeasuredMotion

FRAMES = 30
"""Frames at which clips are compared."""
# Terms of the covariance, in shares of the motions' variance, and the scale in standard deviations
# of the controls. They are those of typical trained models.
LINEAR, CURVED, CONSTANT, SAME_PERFORMER, NUGGET = 0.5, 0.5, 1.0, 0.3, 0.15
SCALE = 2.0


class TakePrediction:
    """Prediction of motions from measures, with one take left out after the other.

    values (N, k): of the motions. performers, takes: of each of them.
    """

    def __init__(self, values: Floats, performers: Sequence[str], takes: Sequence[str]) -> None:
        who, named = np.array(performers), np.array(takes)
        self._values = values
        self._same = who[:, None] == who
        self._groups = [np.flatnonzero(named == take) for take in sorted(set(takes))]
        self._alone = self._square([np.zeros(len(values))])

    def remaining(self, chosen: Sequence[Floats]) -> float:
        """Return the variance that is left with standardised measures (N,) over that without."""
        return self._square(chosen) / self._alone

    def residuals(self, chosen: Sequence[Floats]) -> Floats:
        """Return the values (N, k) less those that the clips of other takes predict."""
        inverse = np.linalg.inv(self.covariance(chosen))
        weighted = inverse @ self._values
        found = np.zeros_like(self._values)
        for own in self._groups:
            found[own] = np.linalg.solve(inverse[np.ix_(own, own)], weighted[own])
        return found

    def covariance(self, chosen: Sequence[Floats]) -> Floats:
        """Return the covariance (N, N) of the motions for standardised measures (N,)."""
        points = np.stack(chosen, axis=1)
        root = np.sqrt(5.0) * np.linalg.norm(points[:, None] - points, axis=-1) / SCALE
        curved = (1.0 + root + root**2 / 3.0) * np.exp(-root)
        found = LINEAR * points @ points.T + CURVED * curved + CONSTANT
        return np.asarray(found + SAME_PERFORMER * self._same + NUGGET * np.eye(len(points)))

    def _square(self, chosen: Sequence[Floats]) -> float:
        return float(np.square(self.residuals(chosen)).sum())


def motion_coefficients(motions: Sequence[MeasuredMotion]) -> Floats:
    """Return the motions (N, k) by coefficients of their principal components."""
    rows = []
    for motion in motions:
        own = motion.positions
        at = np.linspace(0.0, len(own) - 1.0, FRAMES)
        before = np.minimum(at.astype(int), len(own) - 2)
        share = (at - before)[:, None, None]
        rows.append((own[before] * (1.0 - share) + own[before + 1] * share).ravel())
    values = np.array(rows) - np.mean(rows, axis=0)
    left, sizes, _ = np.linalg.svd(values, full_matrices=False)
    return np.asarray(left * sizes)
