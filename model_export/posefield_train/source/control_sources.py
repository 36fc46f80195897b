"""Control parameters of a recipe: read from a column of the table, or measured from the motion."""

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
        "cycle; leg_length, stature: of the performer, m"
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
        given = [key for key in ("joint", "joints", "at") if getattr(self, key) is not None]
        takes, needs = ALLOWED_KEYS.get(self.quantity, ()), REQUIRED_KEYS.get(self.quantity, ())
        if not set(needs) <= set(given) <= set(takes):
            expected = " and ".join(takes) or "nothing"
            optional = " or nothing" if takes and not needs else ""
            found = " and ".join(given) or "nothing"
            raise ValueError(
                f"found {found} besides quantity {self.quantity!r}, expected {expected}{optional}"
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
