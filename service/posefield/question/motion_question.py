"""Queries for poses and for clips, and checks of single values, which raise InvalidField."""

import math
import re
from typing import Annotated, Literal, cast

import msgspec
import numpy as np
from msgspec import UNSET, Meta, Struct, UnsetType

from posefield.common.bounded_types import Whole
from posefield.common.errors import InvalidField
from posefield.common.units import UP, Floats, LengthUnit, UpAxis
from posefield.motion import quat
from posefield.motion.joint_roles import NamingConvention

BodyKind = Literal["none", "mannequin", "bones"]
DEFAULT_BODY: BodyKind = "mannequin"

Body = Annotated[
    BodyKind | None,
    Meta(
        description="body in USD and glTF files: none, mannequin or one box per bone; default: "
        "mannequin"
    ),
]


MAX_TAKE = 999_999_999
"""Largest seed of a take: whole numbers in text have at most nine digits."""
DEFAULT_VARIETY = 0.7
"""Size of a take's deviations, as a share of those of captured clips."""
ExtrapolationPolicy = Literal["ok", "warn", "refuse"]
RootMode = Literal["travelling", "in_place"]
FileRoot = Literal["travelling", "in_place", "bone"]
"""Root of a clip; "bone" is a joint of its own, on the floor above the hips."""
FeetMode = Literal["stand", "as_predicted"]
LimitsPolicy = Literal["refuse", "report"]


class Floor(Struct, frozen=True, forbid_unknown_fields=True):
    """Plane over x and z in the frame of a clip.

    height: at the origin, m. slope_x, slope_z: rise for each metre along the axes.
    """

    height: float
    slope_x: float
    slope_z: float

    @property
    def is_level(self) -> bool:
        """Return whether the floor has no slope."""
        return self.slope_x == self.slope_z == 0.0

    @property
    def slope(self) -> float:
        """Return the rise for each metre in the steepest direction."""
        return float(np.hypot(self.slope_x, self.slope_z))

    @property
    def tilt(self) -> Annotated[Floats, "4"]:
        """Return the rotation by the smallest angle from the vertical to the floor's normal."""
        normal = np.array([-self.slope_x, 1.0, -self.slope_z])
        normal /= np.linalg.norm(normal)
        turn = np.concatenate([[1.0 + normal @ UP], np.cross(UP, normal)])
        rotation: Floats = turn / np.linalg.norm(turn)
        return rotation

    def heights(self, points: Annotated[Floats, "*batch 3"]) -> Annotated[Floats, "*batch"]:
        """Return the heights (...), m, of the floor below or above points (..., 3), m."""
        heights: Floats = (
            self.height + self.slope_x * points[..., 0] + self.slope_z * points[..., 2]
        )
        return heights

    def tilted(self, vectors: Annotated[Floats, "*batch 3"]) -> Annotated[Floats, "*batch 3"]:
        """Return vectors (..., 3) turned as the floor is tilted."""
        return quat.rotate(np.broadcast_to(self.tilt, (*vectors.shape[:-1], 4)), vectors)


LEVEL_FLOOR = Floor(0.0, 0.0, 0.0)
"""Floor at height 0, on which motions are captured."""
FloorValue = float | Floor
"""Floor as a height, m, or as a plane."""
Moment = Literal["start", "end", "event", "highest", "lowest", "farthest"]
"""Moment of the motion; "farthest" is from the root."""
TargetTime = float | Moment
"""Time of a target: seconds from the start of the clip, or a moment of the motion."""
ExactControls = Literal["auto", "none"] | Annotated[tuple[str, ...], Meta(min_length=1)]
LEGAL_NAME = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9._-]{0,99}", re.ASCII)
"""Names that are legal as file names on all systems."""
Name = Annotated[str, Meta(pattern=rf"^{LEGAL_NAME.pattern}\Z")]

# Fields that several queries share. `word`: name of the parameter in URLs and commands, if other
# than the field's; `metavar`: placeholder of its value in the help of a command.
Controls = Annotated[
    dict[str, float],
    Meta(
        description="value of a control; omitted controls are inferred",
        extra={"word": "control", "metavar": "NAME=VALUE"},
    ),
]
Extrapolate = Annotated[
    ExtrapolationPolicy,
    Meta(
        description="policy for controls without similar captured clips and for targets out of "
        "reach: ok, warn or refuse"
    ),
]
Performer = Annotated[
    str | None, Meta(description="name of the performer; default: an unseen performer")
]


Character = Annotated[
    str | None, Meta(description="character of a user that moves; default: that of the model")
]
LabelValue = str | dict[str, float]
"""One name of a label set, or weights of several."""
Labels = Annotated[
    dict[str, LabelValue],
    Meta(
        description="name in a label set such as style, or weights of names (angry:0.7,happy:0.3); "
        "sets that are not given are left open; may be repeated",
        extra={"word": "label", "metavar": "SET=NAME"},
    ),
]


class Target(Struct, frozen=True, forbid_unknown_fields=True):
    """Constraint on the position of a joint at a moment.

    joint: name. position: in the frame of the clip, m. Exactly one of time, s, and at is given.
    """

    joint: str
    position: tuple[float, float, float]
    time: float | UnsetType = UNSET
    at: Moment | UnsetType = UNSET

    def __post_init__(self) -> None:
        if (self.time is UNSET) == (self.at is UNSET):
            given_fields = "neither time nor at" if self.at is UNSET else "time and at"
            raise ValueError(f"{given_fields}, expected one of them")

    @property
    def when(self) -> TargetTime:
        """Return seconds from the start of the clip, or a moment of the motion."""
        return cast(Moment, self.at) if isinstance(self.time, UnsetType) else self.time


class MotionQuestion(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Query for a motion: controls, labels, level of detail and constraints."""

    controls: Controls
    extrapolate: Extrapolate = "warn"
    performer: Performer = None
    labels: Labels = {}
    level: Annotated[Whole, Meta(description="level of detail; 0 is the finest")] = 0
    joint_sigma: Annotated[bool, Meta(description="include sigma of each joint, m")] = False
    exact: Annotated[
        ExactControls,
        Meta(
            description="measured controls to match exactly: auto (all given), none, or names",
            extra={"metavar": "auto|none|NAME,NAME"},
        ),
    ] = "auto"
    targets: Annotated[
        tuple[Target, ...],
        Meta(
            description="target position of a joint, m; MOMENT is a time in seconds, start, end, "
            "event, highest, lowest or farthest; may be repeated",
            extra={"word": "target", "metavar": "JOINT@MOMENT=X,Y,Z"},
        ),
    ] = ()
    take: Annotated[
        Whole,
        Meta(
            description="seed of another take of the motion, equal for equal seeds; 0 is the mean"
        ),
    ] = 0
    variety: Annotated[
        float, Meta(description="size of a take's deviations; 1 is that of captured clips")
    ] = DEFAULT_VARIETY
    detail: Annotated[
        bool, Meta(description="add details that no control predicts, sampled by the take's seed")
    ] = False

    @property
    def has_constraints(self) -> bool:
        """Return whether the answer is more than the prediction at the given controls."""
        return self.exact != "auto" or bool(self.targets) or bool(self.take) or self.detail


class PoseQuestion(MotionQuestion, frozen=True, kw_only=True):
    """Query for poses of a motion."""

    times: Annotated[
        list[float],
        Meta(
            description="time from the start of the clip, s; may be repeated",
            extra={"word": "time", "unit": "s"},
        ),
    ]


class ClipQuestion(MotionQuestion, frozen=True, kw_only=True):
    """Query for a part of a motion, at a frame rate.

    names: renames joints only; bones keep their axes. root: "in_place" removes the root's travel.
    From a cycle it removes the frame that moves along its arc, heading included; from another
    motion the straight line from the first pose to the last, evenly, and keeps the heading. Heights
    are kept, and a model that is in place already is unchanged. loop: a whole cycle as N = max(1,
    round(duration * fps)) steps, without start and end. Its frame N equals the first one if it
    stays in place, else it is the first one moved by the cycle's travel and turn. It plays N / fps
    seconds, which is the rounded duration. feet: "stand" plans stances and swings over the whole
    motion and places the legs; None is "stand" for models that travel and know contacts. floor:
    plane in the frame of the clip; standing feet, swings and the pelvis follow it. limits: "refuse"
    is an error where a robot's hinge turns beyond its limits.
    """

    fps: Annotated[
        float, Meta(description="frame rate, frames a second", extra={"unit": "frames a second"})
    ] = 30.0
    start: Annotated[float, Meta(description="time of the first frame, s", extra={"unit": "s"})] = (
        0.0
    )
    end: Annotated[
        float | None,
        Meta(
            description="latest time of the last frame, s; default: the end of the clip",
            extra={"unit": "s"},
        ),
    ] = None
    names: Annotated[NamingConvention, Meta(description="naming convention of the joints")] = "own"
    root: Annotated[
        FileRoot | None,
        Meta(
            description="whether the root travels, stays in place, or is a bone of its own on the "
            "floor above the hips; default: bone with names=ue5, else travelling"
        ),
    ] = None
    loop: Annotated[
        bool, Meta(description="write one whole cycle whose last frame equals its first")
    ] = False
    feet: Annotated[
        FeetMode | None,
        Meta(
            description="whether feet stand where they contact the ground; default: stand, for "
            "models that travel and know the contacts of their feet"
        ),
    ] = None
    floor: Annotated[
        FloorValue,
        Meta(
            description="floor on which feet stand: its height, m, or height at the origin and "
            "rise for each metre along x and z; default: 0",
            extra={"metavar": "HEIGHT|HEIGHT,SLOPE_X,SLOPE_Z"},
        ),
    ] = 0.0
    limits: Annotated[
        LimitsPolicy,
        Meta(description="whether a clip with a robot's joint beyond its limits is refused"),
    ] = "report"

    @property
    def root_bone(self) -> bool:
        """Return whether files have a root bone."""
        return self.root == "bone" or (self.root is None and self.names == "ue5")

    @property
    def ground(self) -> Floor:
        """Return the floor as a plane."""
        return self.floor if isinstance(self.floor, Floor) else Floor(self.floor, 0.0, 0.0)


class FileQuestion(ClipQuestion, frozen=True, kw_only=True):
    """Query for a clip in a file; unit, up and body are None for the format's defaults.

    character: name of a character of the service.
    """

    unit: Annotated[
        LengthUnit | None, Meta(description="unit of length in the file; default: the format's")
    ] = None
    up: Annotated[UpAxis | None, Meta(description="up axis of the file; default: the format's")] = (
        None
    )
    body: Body = None
    character: Character = None


class NamedClipQuestion(ClipQuestion, frozen=True, kw_only=True):
    """Query for one clip of many, with the name of its file."""

    name: Name | None = None


class ClipsQuestion(Struct, frozen=True, forbid_unknown_fields=True):
    """Query for several clips in one format."""

    format: str
    clips: list[NamedClipQuestion]
    unit: LengthUnit | None = None
    up: UpAxis | None = None
    body: Body = None
    character: Character = None


replace = msgspec.structs.replace


FLOAT32_EPSILON = 2.0**-23
"""Relative error of a number in single precision."""


def check_number(field: str, value: object) -> float:
    """Return a finite number, 0 for -0.

    Raises InvalidField for any other value.
    """
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InvalidField(field, f"{value!r}, expected a number")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise InvalidField(field, f"{number}, expected a finite number")
    return number + 0.0


def check_range(field: str, value: float, low: float, high: float, unit: str) -> None:
    """Raise InvalidField for a value outside low to high."""
    if not low <= value <= high:
        # Nine digits tell any two numbers of single precision apart.
        digits = f"{check_number(field, value):.9g}"
        raise InvalidField(field, f"{digits} {unit}, expected {low:.9g} to {high:.9g} {unit}")


def check_rounded_range(field: str, value: float, low: float, high: float, unit: str) -> float:
    """Return the value, or `high` for a value that is `high` rounded to single precision.

    Clients read durations from responses, and many keep them as float32. Raises InvalidField for a
    value outside low to high.
    """
    if high < value <= high * (1.0 + FLOAT32_EPSILON):
        return high
    check_range(field, value, low, high, unit)
    return value


def check_take(seed: int, variety: float) -> None:
    """Raise InvalidField for the seed or the variety of a take out of range."""
    if not 0 <= seed <= MAX_TAKE:
        raise InvalidField("take", f"{seed}, expected 0 to {MAX_TAKE}")
    if not 0.0 <= variety <= 1.0:
        raise InvalidField("variety", f"{variety:g}, expected 0 to 1")
