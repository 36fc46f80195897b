"""Scripts of performances, built segment by segment."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, TypedDict

import numpy.typing as npt
from msgspec import Struct

from posefield_client import questions
from posefield_client.errors import WrongQuestion
from posefield_client.generated import (
    Body,
    CharacterChoice,
    Extrapolate,
    FeetMode,
    GaitEnd,
    Join,
    NamedScript,
    Names,
    Obstacle,
    PerformanceQuestion,
    PerformanceReport,
    PerformanceStart,
    PlacedTarget,
    Unit,
    Up,
)
from posefield_client.questions import Exact, Labels

Numbers = Sequence[float] | npt.NDArray[Any]
Points = Sequence[Numbers] | npt.NDArray[Any]
Curve = float | Points
"""A number, or pairs of a distance or time in the segment and a value."""


class Planned(Struct, frozen=True):
    """Response to a request for the plan of a performance."""

    trust: PerformanceReport


class ScriptOptions(TypedDict, total=False):
    """Options of a script besides its segments; names, unit, up and body are those of its file."""

    character: CharacterChoice | Mapping[str, Any] | None
    start: PerformanceStart | Mapping[str, Any] | None
    obstacles: Iterable[Obstacle | Mapping[str, Any]] | None
    fps: float | None
    take: int | None
    variety: float | None
    detail: bool | None
    level: int | None
    feet: FeetMode
    extrapolate: Extrapolate | None
    names: Names | None
    unit: Unit
    up: Up
    body: Body


@dataclass(frozen=True)
class Script:
    """Segments of a performance, in order; every method returns a longer script.

        Script().walk("cmu_walk", to=(0, 3)).act("kick", power=0.5).walk(seconds=3)

    Metres, seconds, radians; points of the floor are x to the left and z forward.
    """

    segments: tuple[Mapping[str, Any], ...] = ()

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
        facing: float | None = None,
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
        before. speed: m/s. turn: rad/s to the left. facing: heading of the body on its way to a
        point, rad. start, stop: at full speed or at rest.
        """
        segment = questions.question(locals())
        walks = [segment["model"] for segment in self.segments if segment["kind"] == "walk"]
        if model is None and not walks:
            raise WrongQuestion("a walk without a model, expected one in the first walk")
        return self._with("walk", model or walks[-1], segment)

    def act(
        self,
        model: str,
        /,
        *,
        targets: Iterable[PlacedTarget | Mapping[str, Any]] | None = None,
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
        return self._with("act", model, questions.question(locals()))

    def hold(
        self, seconds: float, *, joint: str | None = None, look_at: Numbers | None = None
    ) -> "Script":
        """Add seconds in which the character stays as it is, after an act at its event.

        joint: that stays where it is. look_at: point that the head turns to, m.
        """
        return self._with("hold", None, questions.question(locals()))

    def document(self) -> dict[str, Any]:
        """Return the script as JSON values, as files of scripts contain it."""
        return {"segments": list(self.segments)}

    def _with(self, kind: str, model: str | None, given: Mapping[str, Any]) -> "Script":
        named = {} if model is None else {"model": questions.model_name(model)}
        options = {key: value for key, value in given.items() if key != "controls" or value}
        return replace(self, segments=(*self.segments, {"kind": kind, **named, **options}))


AnyScript = Script | PerformanceQuestion | NamedScript | Mapping[str, Any]
"""A script, or a document of one as the contract has it."""


def document(script: AnyScript, options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the question of a script with options."""
    if isinstance(script, Script):
        script = script.document()
    if not isinstance(script, Mapping):
        kind = type(script).__name__
        raise WrongQuestion(f"script is a {kind}, expected a Script or a mapping with segments")
    return {**questions.plain("script", script), **questions.question(options)}
