"""Scripts of performances, built segment by segment."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, TypeVar

import msgspec
import numpy.typing as npt
from msgspec import UNSET

from posefield_client import asking
from posefield_client.errors import WrongQuestion
from posefield_client.generated import Act, Hold, Join, PlacedTarget, Walk
from posefield_client.holding import Exact

Segment = Walk | Act | Hold
S = TypeVar("S", Walk, Act, Hold)
Numbers = Sequence[float] | npt.NDArray[Any]
Points = Sequence[Numbers] | npt.NDArray[Any]
Curve = float | Points
"""A number, or pairs of a distance or time in the segment and a value."""
GaitEnd = Literal["rolling", "standing"]
Labels = Mapping[str, str | Mapping[str, float]]


@dataclass(frozen=True)
class Script:
    """Segments of a performance, in order; every method returns a longer script.

        Script().walk("cmu_walk", to=(0, 3)).act("kick", power=0.5).walk(seconds=3)

    Metres, seconds, radians; points of the floor are x to the left and z forward.
    """

    segments: tuple[Segment, ...] = ()

    def __repr__(self) -> str:
        return f"Script({', '.join(map(_words, self.segments))})"

    def walk(
        self,
        model: str | None = None,
        /,
        *,
        along: Points | None = None,
        to: Numbers | None = None,
        seconds: float | None = None,
        speed: Curve | None = None,
        speed_over: Literal["distance", "time"] | None = None,
        turn: Curve | None = None,
        performer: str | None = None,
        labels: Labels | None = None,
        start: GaitEnd | None = None,
        stop: GaitEnd | None = None,
        join: Join | Mapping[str, Any] | None = None,
        controls: Mapping[str, float] | None = None,
        **named: float,
    ) -> "Script":
        """Add a walk: along a curve through points, to a point, or for some seconds.

        With none of them it goes where the act after it begins. model: by default that of the walk
        before. speed: m/s. turn: rad/s to the left. start, stop: at full speed or at rest.
        """
        given = {
            **asking.said(along=along, to=to, seconds=seconds, speed=speed, speed_over=speed_over),
            **asking.said(turn=turn, performer=performer, labels=labels, start=start, stop=stop),
            **asking.said(join=join),
        }
        return self._with(Walk, self._walker(model), given, asking.together(controls, named))

    def act(
        self,
        model: str,
        /,
        *,
        targets: Iterable[PlacedTarget | Mapping[str, Any]] = (),
        exact: Exact | None = None,
        at: Numbers | None = None,
        facing: float | None = None,
        performer: str | None = None,
        labels: Labels | None = None,
        join: Join | Mapping[str, Any] | None = None,
        controls: Mapping[str, float] | None = None,
        **named: float,
    ) -> "Script":
        """Add a motion of a model without cycle, such as a reach or a kick.

        targets: where joints must be, in the world. at, facing: place and heading, rad, of its
        first pose; by default where the segment before it ends, or where its target is met.
        """
        given = {
            **asking.said(exact=(exact,) if _is_name(exact) else exact, at=at, facing=facing),
            **asking.said(performer=performer, labels=labels, join=join),
            **asking.said(targets=tuple(targets) or None),
        }
        return self._with(Act, model, given, asking.together(controls, named))

    def hold(
        self, seconds: float, *, joint: str | None = None, look_at: Numbers | None = None
    ) -> "Script":
        """Add seconds in which the character stays as it is, after an act at its event.

        joint: that stays where it is. look_at: point that the head turns to, m.
        """
        given = asking.said(seconds=seconds, joint=joint, look_at=look_at)
        return self._with(Hold, None, given, {})

    def document(self) -> dict[str, Any]:
        """Return the script as JSON values, as files of scripts contain it."""
        return {"segments": asking.sayable("segments", self.segments)}

    def _with(
        self, kind: type[S], model: str | None, given: dict[str, Any], controls: Mapping[str, float]
    ) -> "Script":
        place = f"segment {len(self.segments)}"
        plain = asking.sayable(place, {**given, "kind": kind.__struct_config__.tag})
        if model is not None:
            plain["model"] = asking.model_name(model)
        if controls:
            plain["controls"] = asking.controls(None, controls)
        return replace(self, segments=(*self.segments, read_segment(place, plain, kind)))

    def _walker(self, model: str | None) -> str:
        """Return the model, by default that of the last walk."""
        walked = [each.model for each in self.segments if isinstance(each, Walk)]
        if model is None and not walked:
            raise WrongQuestion("a walk without a model, expected one in the first walk")
        return walked[-1] if model is None else model


def read_segment(place: str, given: Any, kind: Any = Segment) -> Any:
    """Return a segment; WrongQuestion if it is invalid."""
    try:
        found = msgspec.convert(given, kind)
    except msgspec.ValidationError as fault:
        raise WrongQuestion(f"{place}: {fault}") from None
    targets = getattr(found, "targets", UNSET)
    for number, target in enumerate(() if targets is UNSET else targets):
        if (target.time is UNSET) == (target.at is UNSET):
            raise WrongQuestion(f"{place}, target {number}: expected one of time and at")
    return found


def _is_name(exact: Exact | None) -> bool:
    return isinstance(exact, str) and exact not in ("auto", "none")


def _words(segment: Segment) -> str:
    """Return a segment in two words: its kind, and its model or its duration."""
    if isinstance(segment, Hold):
        return f"hold {segment.seconds:g} s"
    return f"{'walk' if isinstance(segment, Walk) else 'act'} {segment.model}"
