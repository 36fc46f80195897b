"""Ways over the floor that walkers follow: where they lead, and how fast."""

from dataclasses import dataclass

import numpy as np

from service.motion.conventions import Floats, Indices
from service.synthesis.walk import plane
from service.synthesis.walk.plane import Plane

# Between two places that a path is known at, m. The turn between them is even.
STEP = 0.1


@dataclass(frozen=True)
class Paths:
    """N ways, each known at K places that lie STEP apart along it.

    starts (N,): where it begins. headings (N, K), rad, of the tangents, without jumps; between two
    places the way is an arc. speeds (N, K), m/s. lengths (N,), m: where it ends.
    """

    starts: Plane
    headings: Floats
    speeds: Floats
    lengths: Floats

    @property
    def bends(self) -> Floats:
        """Curvature (N, K), 1/m, positive to the left."""
        return np.gradient(self.headings, STEP, axis=1)

    @property
    def places(self) -> Plane:
        """Where the ways are known (N, K)."""
        turns = np.diff(self.headings, axis=1)
        steps = plane.facing(self.headings[:, :-1]) * plane.arc(np.array(STEP), turns)
        return self.starts[:, None] + np.pad(np.cumsum(steps, axis=1), ((0, 0), (1, 0)))

    def at(self, gone: Floats) -> tuple[Plane, Floats]:
        """Places (N, F) and headings (N, F) of the tangent after (N, F) metres."""
        before, share = self._between(gone)
        turns = share * np.take_along_axis(np.diff(self.headings, axis=1), before, axis=1)
        first = np.take_along_axis(self.headings, before, axis=1)
        along = plane.facing(first) * plane.arc(STEP * share, turns)
        return np.take_along_axis(self.places, before, axis=1) + along, first + turns

    def along(self, values: Floats, gone: Floats) -> Floats:
        """Values (N, K, ...) of the known places after (N, F) metres, (N, F, ...), linearly."""
        before, share = self._between(gone)
        rows = np.arange(len(values))[:, None]
        share = share.reshape(*share.shape, *[1] * (values.ndim - 2))
        return (1.0 - share) * values[rows, before] + share * values[rows, before + 1]

    def _between(self, gone: Floats) -> tuple[Indices, Floats]:
        before = np.minimum((gone / STEP).astype(np.int64), self.headings.shape[1] - 2)
        return before, gone / STEP - before
