"""Measures: quantities of a motion that are computed, not entered by hand.

Position of a joint at a moment, greatest distance between the feet, distance and speed of
locomotion, body size. The same definitions measure captured clips and results, so that a query can
constrain them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal, get_args

import numpy as np

from posefield.common.bounded_types import Index, Share
from posefield.common.units import Bones, Floats, Frames, Positions, RootPath, Vector
from posefield.motion import cycle_velocities, quat, skeleton

Quantity = Literal[
    "left",
    "height",
    "forward",
    "step_length",
    "stride_length",
    "speed",
    "turn",
    "left_velocity",
    "forward_velocity",
    "turn_rate",
    "leg_length",
    "stature",
]
MeasureMoment = Literal["start", "end", "highest", "lowest", "farthest", "landmark"]

POSITION_AXES = {"left": 0, "height": 1, "forward": 2}
"""Quantities of a joint's position, m, and the axis of each in the frame of the clip."""
TRAVEL_QUANTITIES = ("stride_length", "speed", "turn", *cycle_velocities.QUANTITIES)
"""Quantities of a whole clip: m, m/s, degrees to the left; m/s, m/s, rad/s to the left."""
BODY_QUANTITIES = ("leg_length", "stature")
"""Quantities of the performer, not of the motion, m."""
UNITS = {"speed": "m/s", "turn": "deg"} | dict(
    zip(cycle_velocities.QUANTITIES, ("m/s", "m/s", "rad/s"), strict=True)
)
"""Units of the quantities that are not in metres."""
QUANTITIES: tuple[str, ...] = get_args(Quantity)
MOMENTS: tuple[str, ...] = get_args(MeasureMoment)


@dataclass(frozen=True)
class Measure:
    """One quantity of a motion.

    joints: for a position those whose centre is taken; for the step length two feet (the greatest
    distance of one ahead of the other); for the leg length the chain from hip to foot; otherwise
    empty. at: moment of a position; "farthest" is from the root. share: canonical time of the
    landmark, as a share of the clip.
    """

    quantity: Quantity
    joints: tuple[Index, ...] = ()
    at: MeasureMoment | None = None
    share: Share | None = None

    @property
    def unit(self) -> str:
        """Return the unit of the values."""
        return UNITS.get(self.quantity, "m")

    @property
    def is_body_measure(self) -> bool:
        """Return whether the quantity is the performer's, independent of the motion."""
        return self.quantity in BODY_QUANTITIES


@dataclass(frozen=True)
class MeasuredMotion:
    """Motion as input of a measure.

    positions: of the joints (F, J, 3), m, at equal steps of time. duration: s. travel (3,): to the
    left and ahead, m, and change of heading, rad. parents: of the joints. offsets: of the bones (J,
    3), m. landmark: fractional frame index, 0 to F - 1, of the measure's landmark.
    """

    positions: Positions
    duration: float
    travel: Vector
    parents: tuple[int, ...]
    offsets: Bones
    landmark: float = 0.0


def evaluate(measure: Measure, motion: MeasuredMotion) -> float:
    """Return the value of a quantity, in its unit."""
    match measure.quantity:
        case quantity if quantity in TRAVEL_QUANTITIES:
            path, seconds = motion.travel[None], np.array([motion.duration])
            return float(travel_values(measure.quantity, path, seconds)[0])
        case "leg_length":
            return float(np.linalg.norm(motion.offsets[list(measure.joints)], axis=-1).sum())
        case "stature":
            return _stature(motion)
        case "step_length":
            return float(np.abs(_foot_separation(measure, motion.positions)).max())
        case _:
            at = moment_frame(measure, motion.positions, motion.landmark)
            position = quat.interpolate_rows(
                _mean_positions(measure, motion.positions), np.array(at)
            )
            return float(position[POSITION_AXES[measure.quantity]])


def travel_values(
    quantity: str, travels: Annotated[Floats, "motions 3"], durations: Annotated[Floats, "motions"]
) -> Annotated[Floats, "motions"]:
    """Return distances, m, speeds, m/s, turns, degrees, or velocities of travels (M, 3).

    durations: (M,), s.
    """
    if quantity == "turn":
        return np.asarray(np.degrees(travels[:, 2]))
    if quantity in cycle_velocities.QUANTITIES:
        column = cycle_velocities.QUANTITIES.index(quantity)
        return np.asarray(cycle_velocities.of_travels(np, travels, durations)[:, column])
    ways = np.hypot(travels[:, 0], travels[:, 1])
    return np.asarray(ways / durations if quantity == "speed" else ways)


def moment_frame(measure: Measure, positions: Positions, landmark: float) -> float:
    """Return the fractional frame index, 0 to F - 1, at which a quantity is measured.

    positions: (F, J, 3), m. landmark: fractional frame index of the landmark.
    """
    last = len(positions) - 1
    match measure.at:
        case "start":
            return 0.0
        case "end":
            return float(last)
        case "landmark":
            return landmark
        case "highest":
            return float(np.argmax(_mean_positions(measure, positions)[:, 1]))
        case "lowest":
            return float(np.argmin(_mean_positions(measure, positions)[:, 1]))
        case "farthest":
            away = _mean_positions(measure, positions) - positions[:, 0]
            return float(np.argmax(np.sum(np.square(away), axis=-1)))
        case _:
            return float(np.argmax(np.abs(_foot_separation(measure, positions))))


def _mean_positions(measure: Measure, positions: Positions) -> RootPath:
    return positions[:, list(measure.joints)].mean(axis=1)


def _foot_separation(measure: Measure, positions: Positions) -> Frames:
    """Return the distance (F,) of the first foot ahead of the second, m."""
    first, second = measure.joints
    return positions[:, first, 2] - positions[:, second, 2]


def _stature(motion: MeasuredMotion) -> float:
    """Return the height of the highest joint above the lowest in the rest pose, m."""
    still = np.zeros((len(motion.parents), 4))
    still[:, 0] = 1.0
    positions = skeleton.positions(motion.parents, still, motion.offsets)
    return float(np.ptp(positions[:, 1]))


def describe(measure: Measure, names: Sequence[str]) -> str:
    """Return a measure as text: "height of rhand at end". names: of all joints."""
    joints = " and ".join(names[joint] for joint in measure.joints)
    of = f" of {joints}" if joints else ""
    at = f" at {measure.at}" if measure.at else ""
    share = "" if measure.share is None else f" ({measure.share:.0%})"
    return f"{measure.quantity.replace('_', ' ')}{of}{at}{share}"


def to_dict(measure: Measure) -> dict[str, Any]:
    """Return a measure as plain values for JSON, without empty fields."""
    values = {"joints": list(measure.joints), "at": measure.at, "share": measure.share}
    return {
        "quantity": measure.quantity,
        **{k: v for k, v in values.items() if v not in (None, [])},
    }


def from_dict(values: Mapping[str, Any]) -> Measure:
    """Return the measure of the plain values of `to_dict`."""
    return Measure(**{**values, "joints": tuple(values.get("joints", ()))})
