"""Report on a retargeted motion, and the settings with which it is made."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

from posefield.common.array_shapes import Vector
from posefield.common.units import round_micrometres
from posefield.question.results import StanceResult

Travel = Literal["scaled", "kept"]
"""Way of the root: in proportion to the legs, or as the motion has it, for places in the world."""


@dataclass(frozen=True)
class HandGoal:
    """A point in the world that a hand meets: `position` (3,), m, at `time`, s, from the start.

    role: leftHand or rightHand. until: time until which it stays there, s; None for the moment.
    """

    role: str
    time: float
    position: Vector
    until: float | None = None

    @property
    def end(self) -> float:
        """Return the last time at which the hand is there, s."""
        return self.time if self.until is None else self.until


@dataclass(frozen=True)
class RetargetSettings:
    """Settings of retargeting.

    stances: of the motion's feet; None to detect them. hands: exact targets of hands, which are
    kept. travel: of the root.
    """

    stances: Sequence[StanceResult] | None = None
    hands: Sequence[HandGoal] = ()
    travel: Travel = "scaled"


USUAL = RetargetSettings()


@dataclass(frozen=True)
class RetargetReport:
    """Facts about a retargeted motion.

    mapped: roles of the motion that the rig follows. missing: roles of the motion that the rig
    lacks. scale: length of the rig's legs over that of the motion's. skate_source, skate_copied,
    skate: mean foot skate of the motion in proportion to the legs, of its copied orientations, and
    of the result, while the motion's feet stand, m/s. legs_turned: mean angle between the bones of
    legs as copied and as given, rad. lowered: most by which the pelvis was lowered so that the legs
    reach, m. penetration: 99th percentile of the depth of soles below the floor, m. hands_missed:
    distance of each hand from its goal, m. warnings: sentences for the user.
    """

    mapped: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    scale: float = 1.0
    skate_source: float = 0.0
    skate_copied: float = 0.0
    skate: float = 0.0
    legs_turned: float = 0.0
    lowered: float = 0.0
    penetration: float = 0.0
    hands_missed: tuple[float, ...] = ()
    warnings: tuple[str, ...] = ()

    def facts(self) -> dict[str, Any]:
        """Return the fields as plain values, lengths rounded to micrometres."""
        found = asdict(self)
        for name, value in found.items():
            if isinstance(value, float):
                found[name] = round_micrometres(value)
        found["hands_missed"] = tuple(map(round_micrometres, self.hands_missed))
        return found
