"""Sources of what varies in a recipe: controls, of the table or measured, and files of curves."""

from typing import Annotated, Any, Literal

from pydantic import (
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    Tag,
    field_validator,
    model_validator,
)

from posefield.motion import measures
from posefield.motion.curves import Curve
from posefield.question import text_decoding
from posefield.question.model_question import SigmaQuestion, WhyQuestion
from posefield.question.motion_question import FileQuestion, PoseQuestion

# Parameters that stand beside the controls in a URL, a body or a table.
RESERVED = {"format"}.union(
    *(
        (parameter.field, parameter.word)
        for form in (PoseQuestion, FileQuestion, SigmaQuestion, WhyQuestion)
        for parameter in text_decoding.parameters(form).values()
    )
)
Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,39}$")]
Text = Annotated[str, Field(min_length=1)]

ROOT_HEIGHT = "root_height"
"""Quantity that measures the height of the root."""
TIME_NAMES = tuple(moment for moment in measures.MOMENTS if moment != "landmark")
"""Moments that need no column of the table."""
# Keys that a quantity accepts besides its name, and those that it requires.
JOINT_AND_TIME, MOMENT, PAIR = ("joint", "at"), ("at",), ("joints",)
ALLOWED_KEYS = {
    **dict.fromkeys(measures.POSITION_AXES, JOINT_AND_TIME),
    ROOT_HEIGHT: MOMENT,
    **dict.fromkeys(("step_length", "leg_length"), PAIR),
}
REQUIRED_KEYS = {quantity: keys for quantity, keys in ALLOWED_KEYS.items() if keys != PAIR}


class KeyFault(ValueError):
    """A mistake that a validator of a recipe finds. keys: its path below the validated part."""

    def __init__(self, message: str, *keys: str | int) -> None:
        super().__init__(message)
        self.keys = keys


class RecipePart(BaseModel):
    """Base of the parts of a recipe; unknown keys are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class Auto(RecipePart):
    """Measurement that yields a control."""

    quantity: Literal[measures.Quantity, "root_height"] = Field(
        description="left, height, forward: coordinate of a joint in the frame of the first pose, "
        "m; root_height: height of the root, m; step_length: greatest distance of one foot ahead "
        "of the other, m; stride_length (m), speed (m/s), turn (degrees to the left): of a whole "
        "cycle; forward_velocity, left_velocity (m/s), turn_rate (rad/s to the left): of a cycle "
        "in the frame that turns with it; leg_length, stature: of the performer, m"
    )
    joint: Text | Annotated[list[Text], Field(min_length=1)] | None = Field(
        default=None,
        description="for a coordinate: the joint, or several joints whose mean position is used",
    )
    joints: Annotated[list[Text], Field(min_length=2, max_length=2)] | None = Field(
        default=None,
        description="for step_length: two feet, default motion.feet; for leg_length: the upper and "
        "the lower end of a leg, default the roles leftUpperLeg and leftFoot",
    )
    at: Text | None = Field(
        default=None,
        description="moment of a coordinate: 'start', 'end', 'highest', 'lowest', 'farthest' (from "
        "the root), or a column of clips.landmarks",
    )

    @property
    def unit(self) -> str:
        """Return the unit of the measured quantity."""
        return measures.UNITS.get(self.quantity, "m")

    @property
    def joint_names(self) -> list[str]:
        """Return the joints whose mean position is measured."""
        return [self.joint] if isinstance(self.joint, str) else list(self.joint or ())

    @model_validator(mode="after")
    def _check_keys(self) -> "Auto":
        stated = [key for key in ("joint", "joints", "at") if getattr(self, key) is not None]
        takes, needs = ALLOWED_KEYS.get(self.quantity, ()), REQUIRED_KEYS.get(self.quantity, ())
        if not set(needs) <= set(stated) <= set(takes):
            expected = " and ".join(takes) or "nothing"
            optional = " or nothing" if takes and not needs else ""
            listed = " and ".join(stated) or "nothing"
            raise ValueError(
                f"found {listed} besides quantity {self.quantity!r}, expected {expected}{optional}"
            )
        if (self.quantity, self.at) == (ROOT_HEIGHT, "farthest"):
            raise KeyFault("found 'farthest', but the root is never away from itself", "at")
        return self


class _NamedControl(RecipePart):
    name: Name

    @field_validator("name")
    @classmethod
    def _check_name(cls, name: str) -> str:
        if name in RESERVED:
            raise ValueError(f"{name!r} is the name of a query parameter")
        return name


class ControlColumn(_NamedControl):
    """One control parameter and the column that holds its value for each clip."""

    column: Text
    unit: Text
    description: Text


class ControlMeasured(_NamedControl):
    """One control parameter that is measured from each clip."""

    auto: Auto
    unit: Text = Field(
        # The quantity determines the unit.
        default_factory=lambda read: read["auto"].unit,
        description="unit of the measured quantity; may be omitted",
    )
    description: Text

    @model_validator(mode="after")
    def _check_unit(self) -> "ControlMeasured":
        if self.unit != self.auto.unit:
            raise KeyFault(
                f"found {self.unit!r}, expected {self.auto.unit!r}, in which "
                f"{self.auto.quantity} is measured, or no unit",
                "unit",
            )
        return self


COLUMN_TAG, MEASURED = "(column)", "(auto)"
"""Tags of the kinds of control in the path of an error: names that no key can have."""


def _kind(control: Any) -> str | None:
    if isinstance(control, ControlColumn | ControlMeasured):
        return COLUMN_TAG if isinstance(control, ControlColumn) else MEASURED
    there = {"column", "auto"} & set(control if isinstance(control, dict) else ())
    return None if len(there) != 1 else COLUMN_TAG if "column" in there else MEASURED


Control = Annotated[
    Annotated[ControlColumn, Tag(COLUMN_TAG)] | Annotated[ControlMeasured, Tag(MEASURED)],
    Discriminator(
        _kind,
        custom_error_type="column_or_auto",
        custom_error_message="expected either column, where its values stand, or auto, how they "
        "are measured",
    ),
]


Distance = Annotated[float, Field(gt=0, le=1000, allow_inf_nan=False)]
End = Annotated[float, Field(allow_inf_nan=False)]
Range = Annotated[list[End], Field(min_length=2, max_length=2)]

UNIT_RANGE = [0.0, 1.0]
DEFAULT_DISTANCE_CM = 2.0


def _check_curve_range(bounds: list[float] | None) -> list[float] | None:
    if bounds is not None and not bounds[0] < bounds[1]:
        raise ValueError(f"found {bounds}, expected the smaller end first")
    return bounds


class CurveKeys(RecipePart):
    """Keys of one curve that differ from those of all curves."""

    range: Range | None = Field(
        default=None, description="smallest and largest value of this curve; default: curves.range"
    )
    distance_cm: Distance | None = Field(
        default=None,
        description="distance that one unit of this curve counts as, cm; default: "
        "curves.distance_cm",
    )

    _ordered = field_validator("range")(_check_curve_range)


class Curves(RecipePart):
    """Scalar curves of the clips, such as weights of blend shapes, each in a CSV file per clip.

    The files have a heading, a column `frame` that counts from 0, and a column per curve.
    """

    column: Text | None = Field(
        default=None,
        description="column of clips.table: file of the clip's curves, relative to the table",
    )
    suffix: Text | None = Field(
        default=None,
        description="text that replaces the ending of the motion file's name in the name of the "
        "file of its curves, such as '.curves.csv'",
    )
    rate: Annotated[float, Field(ge=1, le=10_000, allow_inf_nan=False)] | None = Field(
        default=None,
        description="frames a second of clips that have curves and no skeleton: clips.file names "
        "the files of curves, and the clips get one joint that rests",
    )
    names: list[Text] = Field(
        default=[], description="curves to read; default: all columns of the first clip's file"
    )
    range: Range = Field(
        default=UNIT_RANGE,
        description="smallest and largest value of the curves; a captured value outside is an "
        "error, and answers are clamped",
    )
    distance_cm: Distance = Field(
        default=DEFAULT_DISTANCE_CM,
        description="distance that one unit of a curve counts as, cm, beside the distances of "
        "joints: in the tensor's metric, the budgets and sigma",
    )
    of: dict[str, CurveKeys] = Field(
        default={}, description="keys of single curves, by name, such as [curves.of.jawOpen]"
    )

    _ordered = field_validator("range")(_check_curve_range)

    @property
    def alone(self) -> bool:
        """Return True for clips without a skeleton."""
        return self.rate is not None

    @field_validator("names")
    @classmethod
    def _check_names(cls, names: list[str]) -> list[str]:
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ValueError(f"curves named twice: {twice}")
        return names

    @model_validator(mode="after")
    def _check_place(self) -> "Curves":
        keys = ("column", "suffix", "rate")
        stated = [key for key in keys if getattr(self, key) is not None]
        if len(stated) != 1:
            raise ValueError(
                f"found {', '.join(stated) or 'none'}, expected one of {', '.join(keys)}, which "
                "says where the curves of a clip are"
            )
        return self

    def curve(self, name: str) -> Curve:
        """Return the curve of a name with its range and distance."""
        overrides = self.of.get(name, CurveKeys())
        low, high = overrides.range or self.range
        return Curve(name, low, high, 0.01 * (overrides.distance_cm or self.distance_cm))
