"""When things happen: onsets within a reach, its duration, and the warp of its time."""

from dataclasses import dataclass

import numpy as np

from service.motion.conventions import Floats


def minimum_jerk(u: Floats, onset: float, finish: float) -> Floats:
    """Zero before onset, one after finish, and the quintic of Flash and Hogan (1985) between.

    Twice continuously differentiable.
    """
    t = np.clip((u - onset) / (finish - onset), 0.0, 1.0)
    return t**3 * (10.0 + t * (6.0 * t - 15.0))


def swell(u: Floats) -> Floats:
    """Bump that rises to one half way and leaves both ends with two derivatives at zero."""
    return 64.0 * (u * (1.0 - u)) ** 3


def gaze(u: Floats) -> Floats:
    """Progress of the head, which leads."""
    return minimum_jerk(u, 0.0, 0.6)


def trunk(u: Floats) -> Floats:
    """Progress of pelvis and spine."""
    return minimum_jerk(u, 0.04, 0.92)


def shoulder(u: Floats) -> Floats:
    """Progress of shoulder blade and upper arm."""
    return minimum_jerk(u, 0.08, 1.0)


def elbow(u: Floats) -> Floats:
    """Progress of elbow and wrist, which come last."""
    return minimum_jerk(u, 0.18, 1.0)


def fitts(distance: float) -> float:
    """Duration, s, of a reach over that distance in m to a target 0.1 m wide (Fitts 1954)."""
    return 0.3 + 0.42 * float(np.log2(1.0 + distance / 0.1))


@dataclass(frozen=True)
class Warp:
    """Strictly monotone map of the elapsed fraction of a clip to phase; (a, b) inside unit circle.

    a above zero starts fast and ends fast; b above zero hurries the first half.
    """

    a: float
    b: float

    def __post_init__(self) -> None:
        if np.hypot(self.a, self.b) >= 1.0:
            raise ValueError(f"warp ({self.a}, {self.b}) is not monotone")

    def phase(self, elapsed: Floats) -> Floats:
        """Phase at each elapsed fraction; 0 and 1 stay where they are."""
        turn = 2.0 * np.pi * elapsed
        shift = self.a * np.sin(turn) + self.b * (1.0 - np.cos(turn))
        return elapsed + shift / (2.0 * np.pi)
