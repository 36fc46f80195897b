"""What one more captured clip would be worth, by the controls of those there are.

What counts is the mean variance, over all that may be asked, of the plain field by which the
support flag tells gaps. It hangs on the controls alone, so that each next point is found as if the
ones before had been captured already.
"""

from dataclasses import dataclass

import numpy as np

from service.motion.conventions import Floats, Indices
from service.motion.support import NUGGET, covariances

ASKED = 500
"""Of the candidates, over so many the variance is averaged."""


@dataclass(frozen=True)
class Worth:
    """What a point is worth: by which share the mean variance falls, and the variance there."""

    gain: float
    variance: float


def rank(candidates: Floats, samples: Floats, count: int) -> list[tuple[int, Worth]]:
    """Candidates (C, d), in half-ranges like the samples (n, d), that are worth most, by index, the
    first first; each as if those before it were captured."""
    known = _Field.of(candidates, samples)
    found: list[tuple[int, Worth]] = []
    for _ in range(min(count, len(candidates))):
        gains = known.gains()
        gains[[at for at, _ in found]] = -1.0
        at = int(np.argmax(gains))
        found.append((at, Worth(float(gains[at]), float(known.variances[at]))))
        known.capture(at)
    return found


@dataclass
class _Field:
    """The plain field over candidates (C, d), as far as it is known by what was captured.

    known (k, C): what each thing captured says of each candidate; variances (C,): what is left;
    toward (C, G): covariances with those of the candidates over which the variance is averaged.
    """

    candidates: Floats
    known: list[Floats]
    variances: Floats
    toward: Floats
    averaged: Indices

    @classmethod
    def of(cls, candidates: Floats, samples: Floats) -> "_Field":
        """Field that samples (n, d) are known of."""
        averaged = np.unique(np.linspace(0, len(candidates) - 1, ASKED).astype(np.int64))
        own = covariances(samples, samples) + NUGGET * np.eye(len(samples))
        known = np.linalg.solve(np.linalg.cholesky(own), covariances(samples, candidates))
        toward = covariances(candidates, candidates[averaged]) - known.T @ known[:, averaged]
        left = 1.0 - np.sum(np.square(known), axis=0)
        return cls(candidates, list(known), left, toward, averaged)

    def gains(self) -> Floats:
        """Share by which the mean variance falls where each candidate (C,) is captured."""
        falls = np.mean(np.square(self.toward), axis=1) / (self.variances + NUGGET)
        return np.asarray(falls / self.variances[self.averaged].mean())

    def capture(self, at: int) -> None:
        """Know one of the candidates, too."""
        known = np.stack(self.known)
        own = covariances(self.candidates, self.candidates[[at]])[:, 0] - known.T @ known[:, at]
        said = own / np.sqrt(self.variances[at] + NUGGET)
        self.known.append(said)
        self.variances = self.variances - np.square(said)
        self.toward = self.toward - said[:, None] * said[self.averaged]
