"""Scripts of performances: segments in order, which one long motion goes through; many at once."""

from typing import Annotated, Literal

from msgspec import UNSET, Meta, Struct, UnsetType

from posefield.common.bounded_types import Whole
from posefield.common.units import LengthUnit, UpAxis
from posefield.motion.joint_roles import NamingConvention
from posefield.question.motion_question import (
    Body,
    Character,
    ExactControls,
    ExtrapolationPolicy,
    FeetMode,
    LabelValue,
    Moment,
    Name,
    TargetTime,
)
from posefield.question.walk_question import FieldOfView, ImageHeight, Instancing, LevelPixels

MAX_SEGMENTS = 256
FloorPoint = tuple[float, float]
"""Point on the floor: x to the left and z forward of the world, m."""
Curve = tuple[tuple[float, float], ...]
"""Values at distances, m, or times, s, from the start of a segment; linear between them."""
GaitEnd = Literal["rolling", "standing"]
TargetFrame = Literal["world", "segment"]
BlendKind = Literal["auto", "dead", "hermite", "cut"]
CutChoice = Literal["best", "end"]


class Join(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Join of a segment with the one before it.

    seconds: of the blend. blend: "dead" continues the motion before with a velocity that decays,
    "hermite" lets the difference of both fade, "cut" does neither; "auto" is "hermite" into a walk,
    else "dead". cut: "best" looks for the frames that are most alike, "end" takes the last and the
    first. most: largest distance of the poses at the cut, m.
    """

    seconds: float | None = None
    blend: BlendKind = "auto"
    cut: CutChoice = "best"
    most: float | None = None


class PlacedTarget(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Constraint on the position of a joint at a moment of a segment.

    position: m, in the world, or in the frame of the segment. Exactly one of time, s, from the
    start of the segment's motion, and at is given.
    """

    joint: str
    position: tuple[float, float, float]
    time: float | UnsetType = UNSET
    at: Moment | UnsetType = UNSET
    frame: TargetFrame = "world"

    def __post_init__(self) -> None:
        if (self.time is UNSET) == (self.at is UNSET):
            given_fields = "neither time nor at" if self.at is UNSET else "time and at"
            raise ValueError(f"{given_fields}, expected one of them")

    @property
    def when(self) -> TargetTime:
        """Return seconds from the start of the segment's motion, or a moment of it."""
        return self.time if not isinstance(self.time, UnsetType) else self.at  # type: ignore[return-value]


class Walk(
    Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="walk"
):
    """Segment in which a cyclic model walks.

    along: a smooth curve through points; to: straight to a point; seconds: straight ahead or
    turning. With none of them, the walk goes where the next segment begins. speed: m/s, or a curve
    over the distance or the time; by default the mean captured speed. turn: rad/s to the left, for
    a walk of `seconds` only. facing: heading that the body keeps on its way to a point, rad, from
    standing to standing: on steps to the side or backwards, by default at 0.4 m/s.
    """

    model: str
    along: tuple[FloorPoint, ...] | None = None
    to: FloorPoint | None = None
    seconds: float | None = None
    speed: float | Curve | None = None
    speed_over: Literal["distance", "time"] = "distance"
    turn: float | Curve | None = None
    facing: float | None = None
    controls: dict[str, float] = {}
    performer: str | None = None
    labels: dict[str, LabelValue] = {}
    start: GaitEnd = "rolling"
    stop: GaitEnd = "rolling"
    join: Join = Join()

    def __post_init__(self) -> None:
        ways = [name for name in ("along", "to", "seconds") if getattr(self, name) is not None]
        if len(ways) > 1:
            raise ValueError(f"{' and '.join(ways)}, expected one of them at most")
        if self.turn is not None and self.seconds is None:
            raise ValueError("turn without seconds, expected with a walk of some seconds only")
        if self.facing is not None and (self.start, self.stop) != ("standing",) * 2:
            raise ValueError("facing of a rolling walk, expected start and stop standing")
        if self.facing is not None and self.to is None:
            raise ValueError("facing without to, expected with a walk to a point only")


class Act(
    Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="act"
):
    """Segment in which a model without cycle moves once.

    at: where its first pose stands on the floor. facing: heading of its first pose, rad, positive
    to the left of +Z. Without them it takes place where the segment before it ends; after a walk
    that has no end of its own it takes place where its first target in the world is met.
    """

    model: str
    controls: dict[str, float] = {}
    performer: str | None = None
    labels: dict[str, LabelValue] = {}
    exact: ExactControls = "auto"
    targets: tuple[PlacedTarget, ...] = ()
    at: FloorPoint | None = None
    facing: float | None = None
    join: Join = Join()


class Hold(
    Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="hold"
):
    """Segment in which the character stays as it is.

    After an act with an event, the act stops there. joint: that stays where it is, such as the hand
    that holds something. look_at: point of the world that the head turns to, m.
    """

    seconds: float
    joint: str | None = None
    look_at: tuple[float, float, float] | None = None


Segment = Walk | Act | Hold


class CharacterChoice(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Character of a performance: bones of a model at controls, of a performer or of none."""

    model: str
    performer: str | None = None
    labels: dict[str, LabelValue] = {}
    controls: dict[str, float] = {}


class GivenPose(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Pose of the character: rotations (J, 4), wxyz local to the parents; root_position (3,), m."""

    rotations: tuple[tuple[float, float, float, float], ...]
    root_position: tuple[float, float, float]


class Start(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Begin of a performance: a place, or the end of another motion.

    position: on the floor, m. heading: rad, positive to the left of +Z. poses: last frames of a
    motion before, at the frame rate of the script; two or more keep its velocity.
    """

    position: FloorPoint = (0.0, 0.0)
    heading: float = 0.0
    poses: tuple[GivenPose, ...] = ()

    def __post_init__(self) -> None:
        if self.poses and (self.position != (0.0, 0.0) or self.heading):
            raise ValueError(
                "poses with position or heading, expected one of them: poses have both"
            )


class Disc(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Obstacle on the floor that no path may touch; m."""

    position: FloorPoint
    radius: float


class PerformanceQuestion(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Script of a performance, and how it is written to a file."""

    segments: Annotated[tuple[Segment, ...], Meta(min_length=1, max_length=MAX_SEGMENTS)]
    character: CharacterChoice | None = None
    start: Start = Start()
    obstacles: Annotated[tuple[Disc, ...], Meta(max_length=MAX_SEGMENTS)] = ()
    fps: float = 30.0
    take: Whole = 0
    variety: float = 0.7
    detail: bool = False
    level: Whole = 0
    feet: FeetMode = "stand"
    extrapolate: ExtrapolationPolicy = "warn"
    names: NamingConvention = "own"
    root: Literal["travelling", "bone"] | None = None
    unit: LengthUnit | None = None
    up: UpAxis | None = None
    body: Body = None


PerformanceLayout = Literal["whole", "segments"]
"""Animations in a file: one of the whole performance, or besides it one of each segment."""


class NamedScript(PerformanceQuestion, frozen=True, kw_only=True):
    """Script with the name of its file."""

    name: Name | None = None


class PerformancesQuestion(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Scripts whose performances are written in one format."""

    format: str
    scripts: list[NamedScript]
    layout: PerformanceLayout = "whole"
    character: Character = None


class CrowdStageQuestion(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Stage on which the performances of many scripts are written as one crowd.

    camera (m), fov (rad), height (pixels of the image): select levels of detail whose projected
    error is at most `pixels`.
    """

    camera: Annotated[
        tuple[float, float, float] | None,
        Meta(
            description="of a crowd: camera position, m, which selects each character's level",
            extra={"metavar": "X,Y,Z"},
        ),
    ] = None
    fov: FieldOfView = None
    height: ImageHeight = None
    pixels: LevelPixels = None
    instancing: Annotated[
        Instancing, Meta(description="of a crowd: sharing of data between characters in USD")
    ] = "references"
    body: Body = None
