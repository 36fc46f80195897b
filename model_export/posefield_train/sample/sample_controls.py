"""The four controls of the family, their ranges, the limits of the body, and a reach's timing."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass

import numpy as np

from posefield.common.errors import InvalidField, did_you_mean
from posefield.common.units import Floats
from posefield_train.sample import sample_body

STATURES = {"short": 1.62, "middle": 1.75, "tall": 1.88}
"""The three performers and their statures, m."""

SEAT_RANGE = 0.03
"""Largest distance of a seat below or above the common height, m."""

STAND_RANGE = 0.03
"""Largest distance of a standing hip below the upright one, m."""

RANGES: dict[str, tuple[float, float, str, str]] = {
    "stature": (1.62, 1.88, "m", "Height of the performer"),
    "hip_height": (
        round(sample_body.sitting_hip(1.62) - SEAT_RANGE, 4),
        round(sample_body.standing_hip(1.88), 4),
        "m",
        "Height of the hips at the start: sitting or standing",
    ),
    "turn": (-60.0, 90.0, "deg", "Angle from straight ahead to the target, positive to the right"),
    "target_height": (0.3, 1.9, "m", "Height of the target above the floor"),
}
"""Name: (minimum, maximum, unit, description), in the order of the controls.

The limits of the body reduce the ranges of hip_height and target_height, see `limits`.
"""


@dataclass(frozen=True)
class SampleControls:
    """One point of the control space, in the units of RANGES: `turn` is in degrees."""

    stature: float
    hip_height: float
    turn: float
    target_height: float

    @property
    def azimuth(self) -> float:
        """Return the rotation about +Y from forward to the target, rad; negative to the right."""
        return -math.radians(self.turn)

    @property
    def uprightness(self) -> float:
        """Return 0 at the sitting hip height, 1 at the standing one, linear between and beyond."""
        low, high = sample_body.sitting_hip(self.stature), sample_body.standing_hip(self.stature)
        return (self.hip_height - low) / (high - low)


def limits(name: str, stature: float, hip_height: float) -> tuple[float, float]:
    """Return the range of a control that a body of a stature and hip height, m, can reach."""
    low, high, _, _ = RANGES[name]
    if name == "hip_height":
        return sample_body.sitting_hip(stature) - SEAT_RANGE, sample_body.standing_hip(stature)
    if name == "target_height":
        # The shoulder is about 0.28 statures above the hips, and the arm 0.36 statures long.
        return low, min(high, hip_height + 0.56 * stature)
    return low, high


def parse_controls(controls: Mapping[str, float] | Sequence[float]) -> SampleControls:
    """Return controls from a mapping by name or from four values in the order of RANGES.

    Raises InvalidField for a missing or unknown control, and for one outside the body's limits.
    """
    values = controls if isinstance(controls, Mapping) else _by_name(controls)
    for name in values:
        if name not in RANGES:
            hint = did_you_mean(name, RANGES)
            raise InvalidField(name, f"unknown control{hint}, expected one of {', '.join(RANGES)}")
    for name in RANGES:
        if name not in values:
            raise InvalidField(name, "missing control")
    return _check(SampleControls(*(float(values[name]) for name in RANGES)))


def _by_name(values: Sequence[float]) -> dict[str, float]:
    if len(values) != len(RANGES):
        raise InvalidField("controls", f"{len(values)} values, expected {len(RANGES)}")
    return dict(zip(RANGES, values, strict=True))


def _check(controls: SampleControls) -> SampleControls:
    for (name, (_, _, unit, _)), value in zip(RANGES.items(), astuple(controls), strict=True):
        low, high = limits(name, controls.stature, controls.hip_height)
        # Tolerance for limits that were printed and read again.
        if not low - 1e-6 <= value <= high + 1e-6:
            allowed = f"{low:.6g} to {high:.6g} {unit}"
            raise InvalidField(name, f"{value:.6g} {unit} cannot be reached, expected {allowed}")
    return controls


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
