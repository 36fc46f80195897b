"""Timing of a reach: onsets of the body parts, duration, and time warp."""

from dataclasses import dataclass

import numpy as np

from posefield.common.units import Floats


def minimum_jerk(u: Floats, onset: float, finish: float) -> Floats:
    """Return 0 before onset, 1 after finish, and the quintic of Flash and Hogan (1985) between.

    It is twice continuously differentiable.
    """
    t = np.clip((u - onset) / (finish - onset), 0.0, 1.0)
    return t**3 * (10.0 + t * (6.0 * t - 15.0))


def bell_curve(u: Floats) -> Floats:
    """Return a bump that rises to 1 at u = 0.5, with two zero derivatives at both ends."""
    return 64.0 * (u * (1.0 - u)) ** 3


def gaze(u: Floats) -> Floats:
    """Return the progress of the head, which leads."""
    return minimum_jerk(u, 0.0, 0.6)


def trunk(u: Floats) -> Floats:
    """Return the progress of pelvis and spine."""
    return minimum_jerk(u, 0.04, 0.92)


def shoulder(u: Floats) -> Floats:
    """Return the progress of shoulder blade and upper arm."""
    return minimum_jerk(u, 0.08, 1.0)


def elbow(u: Floats) -> Floats:
    """Return the progress of elbow and wrist, which come last."""
    return minimum_jerk(u, 0.18, 1.0)


def fitts_duration(distance: float) -> float:
    """Return the duration, s, of a reach of a distance, m, to a 0.1 m wide target (Fitts 1954)."""
    return 0.3 + 0.42 * float(np.log2(1.0 + distance / 0.1))


@dataclass(frozen=True)
class TimingWarp:
    """Strictly monotone map of the elapsed fraction of a clip to phase.

    (a, b) lies inside the unit circle, else ValueError. a above zero: fast start and end. b above
    zero: fast first half.
    """

    a: float
    b: float

    def __post_init__(self) -> None:
        if np.hypot(self.a, self.b) >= 1.0:
            raise ValueError(f"warp ({self.a}, {self.b}) is not monotone")

    def phase(self, elapsed: Floats) -> Floats:
        """Return the phase at each elapsed fraction; 0 and 1 are fixed."""
        turn = 2.0 * np.pi * elapsed
        shift = self.a * np.sin(turn) + self.b * (1.0 - np.cos(turn))
        return elapsed + shift / (2.0 * np.pi)
