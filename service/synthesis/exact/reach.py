"""How far off aims lie, judged by how captured motions stray, and how much of the way is gone.

What the others predict for each captured clip misses it by so much in the very values that are
aimed at: a hand that the controls place strays less than its arm does. Aims that lie farther off
than that are approached as far as captured motions go.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from service.motion.conventions import Floats
from service.synthesis.exact.aims import Aim, Looked
from service.synthesis.exact.scene import Scene
from service.synthesis.exact.spread import Spread

# Of the covariance: an even share for all values of an aim, so that none is nothing.
EVEN = 0.1
# Of an aim's even share: what goes along with that of the same joint a moment later.
ALONG = 0.99
# Standard deviations that three coordinates of a target may be off: one captured clip in 300. At 4
# a tenth of the targets 20 cm too far are not told from others, at 3.25 one captured one in 70 is.
FAR = 3.7


@dataclass(frozen=True)
class Reach:
    """The way (k,) from a motion to its aims, and how values like these stray.

    covariance (k, k). members (k, aims): which values are of which aim, ones and zeros.
    """

    left: Floats
    covariance: Floats
    members: Floats

    @cached_property
    def distance(self) -> float:
        """How far off the aims lie, in standard deviations."""
        return float(np.sqrt(self.left @ np.linalg.solve(self.covariance, self.left)))

    @cached_property
    def worth(self) -> Floats:
        """Weight (k,) of each value in what is to become less: one over the mean variance of its
        aim, so that metres and degrees compare."""
        return 1.0 / (self.members @ _means(self.members, np.diagonal(self.covariance)))

    @property
    def way(self) -> Floats:
        """What of the way (k,) captured motions go: all of it, or what is left of each aim's own
        where together they lie too far."""
        limit = far(len(self.left))
        if self.distance <= limit:
            return self.left
        each = self.members * self.left[:, None]
        apart = each.T @ np.linalg.solve(self.covariance, each)
        misses = np.diag(each.T**2 @ self.worth)
        low, high = 0.0, 1.0
        while _length(apart, _shares(apart, misses, high)) > limit:
            low, high = high, 4.0 * high
        for _ in range(40):
            middle = 0.5 * (low + high)
            outside = _length(apart, _shares(apart, misses, middle)) > limit
            low, high = (middle, high) if outside else (low, middle)
        return np.asarray(each @ _shares(apart, misses, high), np.float64)


def of(
    scene: Scene,
    spread: Spread,
    sigma: float,
    numbers: Floats,
    aims: Sequence[Aim],
    looked: Looked,
) -> Reach:
    """Reach from a motion (numbers,) of standard deviation sigma, m.

    looked: what was seen of it, of the aims first.
    """
    members = np.repeat(np.eye(len(aims)), [len(aim.goal) for aim in aims], axis=0)
    values, gradients = (seen[: len(members)] for seen in looked)
    covariance = sigma**2 * _evened(_strays(scene, spread, numbers, aims, gradients), members)
    return Reach(np.concatenate([aim.goal for aim in aims]) - values, covariance, members)


def far(values: int) -> float:
    """How far so many values may be off together, in standard deviations: as unlikely as FAR is for
    three (Wilson and Hilferty 1931)."""
    spread = np.sqrt(2.0 / (9.0 * 3.0))
    share = ((FAR**2 / 3.0) ** (1.0 / 3.0) - (1.0 - spread**2)) / spread
    own = np.sqrt(2.0 / (9.0 * values))
    return float(np.sqrt(values * (1.0 - own**2 + share * own) ** 3))


def _strays(
    scene: Scene, spread: Spread, numbers: Floats, aims: Sequence[Aim], gradients: Floats
) -> Floats:
    """Covariance (k, k) of values that the others predict for captured clips, for a sigma of one
    metre, all with the body and the travel of this motion."""
    motions = np.concatenate([spread.captured, spread.predicted])
    found = np.hstack([aim.among(scene, numbers, motions) for aim in aims])
    clips = len(spread.captured)
    strays = (found[:clips] - found[clips:]) / spread.sigmas[:, None]
    beside = gradients[:, motions.shape[1] :]
    return np.asarray(strays.T @ strays + beside @ spread.beside @ beside.T, np.float64)


def _evened(covariance: Floats, members: Floats) -> Floats:
    """Covariance with an even share for all values of an aim, which goes along with that of other
    aims as the whole of it does: else two that contradict each other would seem near."""
    sizes = members.sum(axis=0)
    place = np.concatenate([np.arange(size) for size in sizes])
    beside = members @ sizes
    alike = (place[:, None] == place) & (beside[:, None] == beside)
    shared = members.T @ (alike * covariance) @ members / sizes
    # What never moves has no variance at all.
    own = np.diag(np.maximum(np.diagonal(shared), 1e-12))
    shared = ALONG * shared + (1.0 - ALONG) * own
    return (1.0 - EVEN) * covariance + EVEN * alike * (members @ shared @ members.T)


def _means(members: Floats, values: Floats) -> Floats:
    return np.asarray(members.T @ values / members.sum(axis=0), np.float64)


def _shares(apart: Floats, misses: Floats, price: float) -> Floats:
    """Shares (aims,) of the ways for which misses and a price of the distance are least."""
    # An aim that is met already has no way to go.
    met = np.diag((np.diagonal(misses) == 0.0).astype(float))
    found = np.linalg.solve(price * apart + misses + met, np.diagonal(misses))
    return np.asarray(np.clip(found, 0.0, 1.0), np.float64)


def _length(apart: Floats, shares: Floats) -> float:
    return float(np.sqrt(shares @ apart @ shares))
