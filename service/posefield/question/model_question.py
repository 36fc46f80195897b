"""Queries about a model: sigma grids, reasons of a result, and clips to capture next."""

from typing import Annotated

from msgspec import Meta, Struct

from posefield.common.bounded_types import Whole
from posefield.common.errors import InvalidField
from posefield.question.motion_question import (
    Controls,
    Extrapolate,
    Labels,
    LabelValue,
    Performer,
    check_range,
)

MIN_VALUES, MAX_VALUES, MAX_MARGIN = 2, 1024, 1.0
"""Limits of the values per axis of a grid, and of its margin as a share of a control's range."""
MAX_NEAREST, MAX_SUGGESTIONS = 10_000, 200


class SigmaQuestion(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Query for a sigma grid: `columns` values of the control `across` by `rows` of `along`.

    controls: values of the other controls, by default those of the card. margin: share of a
    control's sampled range by which the grid extends beyond it on either side.
    """

    across: str
    along: str
    columns: Whole = 32
    rows: Whole = 32
    controls: Controls = {}
    performer: Performer = None
    labels: Labels = {}
    margin: float = 0.0

    def __post_init__(self) -> None:
        if self.across == self.along:
            raise InvalidField("along", f"{self.along!r}, expected another control than across")
        for name in ("columns", "rows"):
            check_range(name, getattr(self, name), MIN_VALUES, MAX_VALUES, "values")
        check_range("margin", self.margin, 0.0, MAX_MARGIN, "of the range")

    def __len__(self) -> int:
        return self.columns * self.rows


class WhyQuestion(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Query for the reasons of a result at given controls."""

    controls: Controls
    extrapolate: Extrapolate = "warn"
    performer: Performer = None
    labels: Labels = {}
    nearest: Annotated[Whole, Meta(description="number of captured clips to list")] = 10

    def __post_init__(self) -> None:
        check_range("nearest", self.nearest, 1, MAX_NEAREST, "clips")


class SuggestQuestion(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Query for the clips to capture next."""

    count: Annotated[Whole, Meta(description="number of points to list")] = 10
    performer: Annotated[
        str | None,
        Meta(description="performer whose clips alone count as captured; default: all performers"),
    ] = None
    labels: Annotated[
        dict[str, LabelValue],
        Meta(
            description="names whose clips alone count as captured, by label set; may be repeated",
            extra={"word": "label", "metavar": "SET=NAME"},
        ),
    ] = {}

    def __post_init__(self) -> None:
        check_range("count", self.count, 1, MAX_SUGGESTIONS, "points")
