"""What one more captured clip would be worth, by the controls and performers of those there are.

A kriging field's variance hangs on where its samples lie, not on what they are, so that each next
point is found as if the ones before had been captured already. The one comes first that lowers the
squared variance, over all that may be asked, most: what is least known counts more.
"""

from dataclasses import dataclass

import numpy as np

from service.motion import field
from service.motion.conventions import Floats, Indices
from service.motion.field import Hyper

ASKED = 500
"""Of the candidates, over so many the variance is averaged."""
# Standard deviation of what the drift's coefficients may be: more than any that are found.
DRIFT = 10.0


@dataclass(frozen=True)
class Worth:
    """What a point is worth: by which share the mean variance falls, and the variance there, as a
    share of the sill."""

    gain: float
    variance: float


def rank(hyper: Hyper, candidates: Floats, samples: Floats, count: int) -> list[tuple[int, Worth]]:
    """Candidates (C, d + p), points like the samples (n, d + p), that are worth most, by index, the
    first first; each as if those before it were captured."""
    known = _Field.of(hyper, candidates, samples)
    found: list[tuple[int, Worth]] = []
    for _ in range(min(count, len(candidates))):
        scores = known.scores()
        scores[[at for at, _ in found]] = -1.0
        at = int(np.argmax(scores))
        found.append((at, Worth(known.gain(at), float(known.variances[at]))))
        known.capture(at)
    return found


def variances(hyper: Hyper, points: Floats, samples: Floats) -> Floats:
    """Variance (B,) of the field at points (B, d + p), as a share of the sill."""
    return _Field.of(hyper, points, samples).variances


@dataclass
class _Field:
    """A field over candidates (C, d + p), as far as it is known by what was captured.

    known (k, C): what each thing captured says of each candidate; variances (C,): what is left;
    toward (C, G): covariances with those of the candidates over which the variance is averaged.
    """

    hyper: Hyper
    candidates: Floats
    known: list[Floats]
    variances: Floats
    toward: Floats
    averaged: Indices

    @classmethod
    def of(cls, hyper: Hyper, candidates: Floats, samples: Floats) -> "_Field":
        """Field that samples (n, d + p) are known of."""
        averaged = np.unique(np.linspace(0, len(candidates) - 1, ASKED).astype(np.int64))
        own = _covariances(hyper, samples, samples) + hyper.nugget * np.eye(len(samples))
        known = np.linalg.solve(np.linalg.cholesky(own), _covariances(hyper, samples, candidates))
        toward = _covariances(hyper, candidates, candidates[averaged])
        toward -= known.T @ known[:, averaged]
        left = _prior(hyper, candidates) - np.sum(np.square(known), axis=0)
        return cls(hyper, candidates, list(known), left, toward, averaged)

    def scores(self) -> Floats:
        """By how much the squared variance falls where each candidate (C,) is captured."""
        falls = np.square(self.toward) @ self.variances[self.averaged]
        return np.asarray(falls / (self.variances + self.hyper.nugget))

    def gain(self, at: int) -> float:
        """Share by which the mean variance falls where a candidate is captured."""
        falls = np.mean(np.square(self.toward[at])) / (self.variances[at] + self.hyper.nugget)
        return float(falls / self.variances[self.averaged].mean())

    def capture(self, at: int) -> None:
        """Know one of the candidates, too."""
        known = np.stack(self.known)
        own = _covariances(self.hyper, self.candidates, self.candidates[[at]])[:, 0]
        own -= known.T @ known[:, at]
        said = own / np.sqrt(self.variances[at] + self.hyper.nugget)
        self.known.append(said)
        self.variances = self.variances - np.square(said)
        self.toward = self.toward - said[:, None] * said[self.averaged]


def _covariances(hyper: Hyper, a: Floats, b: Floats) -> Floats:
    """Covariance (A, B) of field and drift between points (A, d + p) and (B, d + p)."""
    return field.covariances(hyper, a, b) + DRIFT**2 * _drift(hyper, a) @ _drift(hyper, b).T


def _prior(hyper: Hyper, points: Floats) -> Floats:
    """Variance (B,) at points (B, d + p) where nothing was captured."""
    return 1.0 + DRIFT**2 * np.sum(np.square(_drift(hyper, points)), axis=1)


def _drift(hyper: Hyper, points: Floats) -> Floats:
    return field.drift(points, len(hyper.scales), max(hyper.drifts))
