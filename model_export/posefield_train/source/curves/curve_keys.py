"""Keys of a recipe's section `[curves]`."""

from typing import Annotated

from pydantic import Field, field_validator, model_validator

from posefield.motion.curves import Curve
from posefield_train.source.control_sources import RecipePart, Text

Distance = Annotated[float, Field(gt=0, le=1000, allow_inf_nan=False)]
End = Annotated[float, Field(allow_inf_nan=False)]
Range = Annotated[list[End], Field(min_length=2, max_length=2)]

UNIT_RANGE = [0.0, 1.0]
DEFAULT_DISTANCE_CM = 2.0


def _check_range(found: list[float] | None) -> list[float] | None:
    if found is not None and not found[0] < found[1]:
        raise ValueError(f"found {found}, expected the smaller end first")
    return found


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

    _ordered = field_validator("range")(_check_range)


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

    _ordered = field_validator("range")(_check_range)

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
        places = ("column", "suffix", "rate")
        found = [key for key in places if getattr(self, key) is not None]
        if len(found) != 1:
            raise ValueError(
                f"found {', '.join(found) or 'none'}, expected one of {', '.join(places)}, which "
                "says where the curves of a clip are"
            )
        return self

    def curve(self, name: str) -> Curve:
        """Return the curve of a name with its range and distance."""
        own = self.of.get(name, CurveKeys())
        low, high = own.range or self.range
        return Curve(name, low, high, 0.01 * (own.distance_cm or self.distance_cm))
