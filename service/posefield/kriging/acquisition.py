"""Acquisition function: expected variance reduction by one more captured clip.

The criterion is the mean kriging variance, over the candidates, of the field that decides support.
It depends on the controls alone, so that each next point is selected as if the points before had
been captured already.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common import cancellation
from posefield.common.array_shapes import SampleControls
from posefield.common.cancellation import ProgressCallback, ignore_progress
from posefield.common.units import Floats, Indices
from posefield.kriging.support import NUGGET, covariances

AVERAGED_CANDIDATES = 500
"""Number of candidates over which the variance is averaged."""


@dataclass(frozen=True)
class VarianceReduction:
    """Value of a point: the share by which the mean variance falls, and the variance there."""

    gain: float
    variance: float


def rank_candidates(
    candidates: Annotated[Floats, "candidates controls"],
    samples: SampleControls,
    count: int,
    progress: ProgressCallback = ignore_progress,
) -> list[tuple[int, VarianceReduction]]:
    """Return the candidates (C, d) of the largest gains, by index, in greedy order.

    samples (n, d): captured, in half-ranges like the candidates. Each gain assumes the candidates
    before it as captured.
    """
    known = _ConditionedField.conditioned_on(candidates, samples)
    found: list[tuple[int, VarianceReduction]] = []
    most = min(count, len(candidates))
    for done in range(most):
        cancellation.check()
        gains = known.gains()
        gains[[at for at, _ in found]] = -1.0
        at = int(np.argmax(gains))
        found.append((at, VarianceReduction(float(gains[at]), float(known.variances[at]))))
        known.condition_on(at)
        progress(done + 1, most)
    return found


@dataclass
class _ConditionedField:
    """Kriging field over candidates (C, d), conditioned on the captured points.

    whitened: k rows (C,), the whitened covariances of each captured point with the candidates.
    variances (C,): of the candidates. remaining (C, G): covariances with the candidates over which
    the variance is averaged, `averaged`.
    """

    candidates: Annotated[Floats, "candidates controls"]
    whitened: list[Annotated[Floats, "candidates"]]
    variances: Annotated[Floats, "candidates"]
    remaining: Annotated[Floats, "candidates averaged"]
    averaged: Annotated[Indices, "averaged"]

    @classmethod
    def conditioned_on(
        cls, candidates: Annotated[Floats, "candidates controls"], samples: SampleControls
    ) -> "_ConditionedField":
        """Return the field conditioned on samples (n, d)."""
        averaged = np.unique(
            np.linspace(0, len(candidates) - 1, AVERAGED_CANDIDATES).astype(np.int64)
        )
        own = covariances(samples, samples) + NUGGET * np.eye(len(samples))
        known = np.linalg.solve(np.linalg.cholesky(own), covariances(samples, candidates))
        toward = covariances(candidates, candidates[averaged]) - known.T @ known[:, averaged]
        left = 1.0 - np.sum(np.square(known), axis=0)
        return cls(candidates, list(known), left, toward, averaged)

    def gains(self) -> Annotated[Floats, "candidates"]:
        """Return the share by which the mean variance falls if each candidate (C,) is captured."""
        falls = np.mean(np.square(self.remaining), axis=1) / (self.variances + NUGGET)
        return np.asarray(falls / self.variances[self.averaged].mean())

    def condition_on(self, at: int) -> None:
        """Condition the field on one of the candidates as well."""
        known = np.stack(self.whitened)
        own = covariances(self.candidates, self.candidates[[at]])[:, 0] - known.T @ known[:, at]
        said = own / np.sqrt(self.variances[at] + NUGGET)
        self.whitened.append(said)
        self.variances = self.variances - np.square(said)
        self.remaining = self.remaining - said[:, None] * said[self.averaged]
