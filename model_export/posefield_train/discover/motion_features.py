"""Features of the frames of takes, in which equal motions are near wherever they happen."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from posefield.common.units import Floats
from posefield_train.discover.take_reading import Take

RATE = 30.0
"""Frames a second at which features are measured."""
SEARCH_RATE = 10.0
"""Frames a second at which they are compared."""
WEIGHTS = {
    "hips": 1.0,
    "neck": 1.0,
    "head": 0.5,
    **{
        side + role: weight
        for side in ("left", "right")
        for role, weight in (
            ("UpperArm", 0.4),
            ("LowerArm", 1.0),
            ("Hand", 1.0),
            ("UpperLeg", 0.5),
            ("LowerLeg", 1.0),
            ("Foot", 1.0),
            ("Toes", 0.5),
        )
    },
}
"""Weight of the place of each role's joint; roles that a take lacks do not count."""
TRAVEL_WEIGHT, TURN_WEIGHT = 0.25, 0.15
"""Weights of the planar velocity of the root, leg lengths a second, and of its turn, rad/s."""
VELOCITY_SPAN = 0.1
"""Half the time over which a velocity is measured, s."""
EXPLAINED = 0.9
"""Share of the variance that the principal components keep."""
STILL = 1e-6
"""Largest range of a feature of takes in which nothing moves, leg lengths."""


class StillTakes(ValueError):
    """Takes in which nothing moves."""


@dataclass(frozen=True)
class Corpus:
    """Features of takes in one basis.

    roles: joints whose places are compared. features: (F, k) of each take, at SEARCH_RATE.
    """

    takes: tuple[Take, ...]
    roles: tuple[str, ...]
    features: tuple[Floats, ...]

    def frame(self, take: int, at: float) -> int:
        """Return the recorded frame of a take at a time, s."""
        own = self.takes[take]
        return max(min(round(at * own.rate), len(own) - 1), own.first)

    def is_whole(self, take: int, start: float, end: float) -> bool:
        """Return whether no joint leaps between two times of a take, s."""
        return self.takes[take].is_whole(self.frame(take, start), self.frame(take, end))


def build_corpus(takes: Sequence[Take]) -> Corpus:
    """Return the features of takes, which may have different skeletons.

    Raises StillTakes for takes in which nothing moves.
    """
    lacking = lacking_roles(takes)
    roles = tuple(role for role in WEIGHTS if role not in lacking)
    raw = [take_features(take, roles) for take in takes]
    mean, basis = principal_components(np.concatenate(raw))
    step = round(RATE / SEARCH_RATE)
    return Corpus(tuple(takes), roles, tuple((own[::step] - mean) @ basis for own in raw))


def lacking_roles(takes: Sequence[Take]) -> list[str]:
    """Return the roles that a take lacks, so that the takes are not compared in them."""
    return [role for role in WEIGHTS if any(role not in take.places for take in takes)]


def take_features(take: Take, roles: Sequence[str]) -> Floats:
    """Return the features (F, 3 R + 3) of a take at RATE: places of R roles, travel and turn.

    Places are relative to the hips on the floor of the take, in the heading of the hips.
    """
    times = np.arange(0.0, (len(take) - 1) / take.rate + 1e-9, 1.0 / RATE)
    own = np.arange(len(take)) / take.rate
    angles = np.interp(times, own, take.headings())
    places = {role: _resampled(take.places[role], own, times) for role in {*roles, "hips"}}
    floor = np.percentile(np.concatenate([places[role][:, 1] for role in roles]), 1.0)
    base = places["hips"] * [1.0, 0.0, 1.0] + [0.0, floor, 0.0]
    columns = [WEIGHTS[role] * _turned(places[role] - base, -angles) for role in roles]
    travel = _turned(_velocity(places["hips"]), -angles)[:, [0, 2]]
    turn = _velocity(angles[:, None])
    return np.concatenate([*columns, TRAVEL_WEIGHT * travel, TURN_WEIGHT * turn], axis=1)


def principal_components(values: Floats) -> tuple[Floats, Floats]:
    """Return the mean (d,) and the directions (d, k) that keep EXPLAINED of the variance.

    Raises StillTakes without variance.
    """
    mean = values.mean(axis=0)
    if np.ptp(values, axis=0).max() < STILL:
        raise StillTakes("nothing moves in the takes, expected motions to compare")
    variances, directions = np.linalg.eigh(np.cov(values - mean, rowvar=False))
    share = np.cumsum(variances[::-1]) / variances.sum()
    count = int(np.searchsorted(share, EXPLAINED)) + 1
    return mean, np.asarray(directions[:, ::-1][:, :count])


def _resampled(places: Floats, own: Floats, times: Floats) -> Floats:
    return np.stack([np.interp(times, own, places[:, axis]) for axis in range(3)], axis=1)


def _turned(vectors: Floats, angles: Floats) -> Floats:
    """Return vectors (F, 3) turned about y by angles (F,), rad."""
    x, y, z = vectors.T
    cos, sin = np.cos(angles), np.sin(angles)
    return np.stack([x * cos + z * sin, y, z * cos - x * sin], axis=1)


def _velocity(values: Floats) -> Floats:
    """Return the rates of change (F, k) of values (F, k) at RATE, per second."""
    half = round(VELOCITY_SPAN * RATE)
    padded = np.pad(values, ((half, half), (0, 0)), mode="edge")
    return np.asarray((padded[2 * half :] - padded[: -2 * half]) * RATE / (2 * half))
