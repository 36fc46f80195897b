"""The four controls of the family, their ranges, and the limits of the body."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass

from posefield.common.errors import InvalidField, did_you_mean
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
