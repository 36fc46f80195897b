"""Acts on their way to a place."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from posefield.performance.acts.act_segment import Act
from posefield.performance.passages.passage import FloorMotion, Passage


def _no_goal(angle: float) -> FloorMotion:
    raise TypeError("an act without a goal, expected one that may face any way")


@dataclass(frozen=True)
class StagedAct:
    """An act and its place.

    segment: its index. by: motion that places it; None for any place, or for any heading at its
    goal. facing: returns the motion for a heading of the first frame, rad, at the goal. adapted:
    its passage as one of the character, if it is known.
    """

    segment: int
    act: Act
    by: FloorMotion | None
    goal: complex = 0j
    facing: Callable[[float], FloorMotion] = _no_goal
    adapted: Passage | None = None

    def faced(self, angle: float) -> "StagedAct":
        """Return the act with a heading of its first frame, rad."""
        return replace(self, by=self.facing(angle))
