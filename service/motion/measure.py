"""What can be measured of a motion, so that nobody types it by hand and a query can be held to it.

Where a joint is at a moment, how far apart the feet get, how far and how fast a walker goes, how
large the performer is. The same definitions measure captured clips and answers.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np

from service.motion import blend, skeleton
from service.motion.conventions import Floats

Quantity = Literal[
    "left",
    "height",
    "forward",
    "step_length",
    "stride_length",
    "speed",
    "turn",
    "leg_length",
    "stature",
]
At = Literal["start", "end", "highest", "lowest", "farthest", "landmark"]

AXES = {"left": 0, "height": 1, "forward": 2}
"""Quantities of a joint's place at a moment, m, and the axis of each, in the frame of the clip."""
TRAVELLED = ("stride_length", "speed", "turn")
"""What a whole clip covers: m, m/s, degrees to the left."""
BODILY = ("leg_length", "stature")
"""Of the performer, not of the motion, m."""
UNITS = {"speed": "m/s", "turn": "deg"}
"""Units of what is not measured in metres."""
QUANTITIES: tuple[str, ...] = get_args(Quantity)
MOMENTS: tuple[str, ...] = get_args(At)


@dataclass(frozen=True)
class Measure:
    """One quantity.

    joints: whose middle is looked at for a place, two feet for a step's length (the greatest
    distance ahead that one gets of the other), the chain from hip to foot for a leg's length;
    empty for all else. at: the moment of a place; farthest is from the root. share: of canonical
    time at which the landmark of that moment is.
    """

    quantity: Quantity
    joints: tuple[int, ...] = ()
    at: At | None = None
    share: float | None = None

    @property
    def unit(self) -> str:
        """Unit of its values."""
        return UNITS.get(self.quantity, "m")

    @property
    def bodily(self) -> bool:
        """Whether it is the performer's, whom no correction of the motion changes."""
        return self.quantity in BODILY


@dataclass(frozen=True)
class Seen:
    """A motion that is measured: joint positions (F, J, 3), m, evenly in some time, its duration,
    s, how far it goes (3,): to the left and ahead, m, and the change of heading, rad; bone offsets
    (J, 3), m, with the joints' parents. landmark: the place among the frames, from 0 to F - 1, of
    the landmark that is asked for."""

    positions: Floats
    duration: float
    travel: Floats
    parents: tuple[int, ...]
    offsets: Floats
    landmark: float = 0.0


def value(measure: Measure, seen: Seen) -> float:
    """Value of a quantity, in its unit."""
    match measure.quantity:
        case "stride_length" | "speed" | "turn":
            return travelled(measure.quantity, seen.travel, seen.duration)
        case "leg_length":
            return float(np.linalg.norm(seen.offsets[list(measure.joints)], axis=-1).sum())
        case "stature":
            return _stature(seen)
        case "step_length":
            return float(np.abs(_stride_out(measure, seen.positions)).max())
        case _:
            at = moment(measure, seen.positions, seen.landmark)
            place = blend.between(_middle(measure, seen.positions), np.array(at))
            return float(place[AXES[measure.quantity]])


def travelled(quantity: str, travel: Floats, duration: float) -> float:
    """Length of the way, m, its speed, m/s, or the change of heading, degrees, of a travel (3,)."""
    if quantity == "turn":
        return float(np.degrees(travel[2]))
    way = float(np.hypot(travel[0], travel[1]))
    return way / duration if quantity == "speed" else way


def moment(measure: Measure, positions: Floats, landmark: float) -> float:
    """Place among frames (F, J, 3), from 0 to F - 1, at which a quantity is measured."""
    last = len(positions) - 1
    match measure.at:
        case "start":
            return 0.0
        case "end":
            return float(last)
        case "landmark":
            return landmark
        case "highest":
            return float(np.argmax(_middle(measure, positions)[:, 1]))
        case "lowest":
            return float(np.argmin(_middle(measure, positions)[:, 1]))
        case "farthest":
            away = _middle(measure, positions) - positions[:, 0]
            return float(np.argmax(np.sum(np.square(away), axis=-1)))
        case _:
            return float(np.argmax(np.abs(_stride_out(measure, positions))))


def _middle(measure: Measure, positions: Floats) -> Floats:
    return positions[:, list(measure.joints)].mean(axis=1)


def _stride_out(measure: Measure, positions: Floats) -> Floats:
    """How far ahead the first foot is of the second (F,), m."""
    first, second = measure.joints
    return positions[:, first, 2] - positions[:, second, 2]


def _stature(seen: Seen) -> float:
    """Height of the highest joint above the lowest, all bones as at rest, m."""
    still = np.zeros((len(seen.parents), 4))
    still[:, 0] = 1.0
    positions, _ = skeleton.forward(seen.parents, still, seen.offsets)
    return float(np.ptp(positions[:, 1]))


def words(measure: Measure, names: Sequence[str]) -> str:
    """A measure in words: "height of rhand at end". names: of all joints."""
    own = " and ".join(names[joint] for joint in measure.joints)
    of = f" of {own}" if own else ""
    at = f" at {measure.at}" if measure.at else ""
    when = "" if measure.share is None else f" ({measure.share:.0%})"
    return f"{measure.quantity.replace('_', ' ')}{of}{at}{when}"


def plain(measure: Measure) -> dict[str, Any]:
    """The same as JSON has it."""
    known = {"joints": list(measure.joints), "at": measure.at, "share": measure.share}
    return {"quantity": measure.quantity, **{k: v for k, v in known.items() if v not in (None, [])}}


def parse(found: Mapping[str, Any]) -> Measure:
    """The measure that `plain` wrote."""
    return Measure(**{**found, "joints": tuple(found.get("joints", ()))})
