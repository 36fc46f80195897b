"""Requested walk of a performance, and its fields that exclude each other."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from posefield.common.errors import InvalidField
from posefield.common.units import Floats
from posefield.performance.passages.passage import FloorMotion
from posefield.performance.walks.discs import MAX_DISCS, Disc, check_discs
from posefield.performance.walks.speed_profile import (
    COMFORTABLE,
    MAX_ACCELERATION,
    Curve,
    Scale,
)
from posefield.question.motion_question import LabelValue
from posefield.question.value_validation import check_number, check_range

Motion = Literal["rolling", "standing"]


@dataclass(frozen=True)
class WalkRequest:
    """Requested walk: exactly one of `along`, `to`, `seconds`, or `end` alone.

    along: waypoints (P, 2), x and z, m. to: point, x and z, m. arrive_heading: there, rad. seconds:
    duration, s, straight ahead or with `turn`, rad/s: a number or pairs of a time, s, and a rate.
    end: place and heading in which the walk ends; with `along` after its last waypoint. speed: m/s,
    or pairs of a distance, m, or time, s, and a speed. labels: name or weights by label set.
    controls: given controls by name. start, stop: whether the walk begins and ends in motion or
    standing. entry_speed, entry_turn: m/s and rad/s at which it begins in motion; None for those of
    the curves. acceleration: of starts, stops and from the entry speed, m/s². obstacles: discs.
    detour: whether a path to a place may lead around them; else one that crosses them is refused.
    """

    speed: Curve
    along: Floats | None = None
    to: tuple[float, float] | None = None
    seconds: float | None = None
    end: FloorMotion | None = None
    arrive_heading: float | None = None
    turn: Curve | None = None
    speed_over: Scale = "distance"
    labels: Mapping[str, LabelValue] = field(default_factory=dict)
    controls: Mapping[str, float] = field(default_factory=dict)
    start: Motion = "rolling"
    stop: Motion = "rolling"
    entry_speed: float | None = None
    entry_turn: float | None = None
    acceleration: float = COMFORTABLE
    obstacles: tuple[Disc, ...] = ()
    detour: bool = False


@dataclass(frozen=True)
class WalkNote:
    """Note on a plan: a code, the field that it is about, and a sentence."""

    code: str
    field: str
    message: str


def check_fields(request: WalkRequest) -> None:
    """Raise InvalidField for fields that exclude each other or that go only with others."""
    given = [name for name in ("along", "to", "seconds") if getattr(request, name) is not None]
    if len(given) > 1 or not (given or request.end):
        raise InvalidField(
            given[-1] if given else "along",
            f"{' and '.join(given) or 'none'} given, expected one of along, to and seconds",
        )
    if request.end and given not in ([], ["along"]):
        raise InvalidField("end", f"given with {given[0]}, expected alone or with along")
    if request.turn is not None and request.seconds is None:
        raise InvalidField("turn", "given without seconds, expected only with seconds")
    if request.entry_turn is not None and request.seconds is None:
        raise InvalidField("entry_turn", "given without seconds, expected only with seconds")
    if request.arrive_heading is not None and request.to is None:
        raise InvalidField("arrive_heading", "given without to, expected only with to")
    if request.detour and (request.along is not None or request.seconds is not None):
        raise InvalidField("detour", "given with along or seconds, expected only with to or end")
    if request.detour and len(request.obstacles) > MAX_DISCS:
        found = len(request.obstacles)
        raise InvalidField("obstacles", f"{found}, expected at most {MAX_DISCS} with a detour")
    check_discs(request.obstacles)
    check_number("acceleration", request.acceleration)
    check_range("acceleration", request.acceleration, 0.1, MAX_ACCELERATION, "m/s²")
