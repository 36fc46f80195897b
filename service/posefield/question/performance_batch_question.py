"""Many scripts of performances in one request or one crowd, and the layout of their files."""

from typing import Annotated, Literal

from msgspec import Meta, Struct

from posefield.question.body_kind import Body
from posefield.question.motion_question import Character, Name
from posefield.question.performance_question import PerformanceQuestion
from posefield.question.walk_question import FieldOfView, ImageHeight, Instancing, LevelPixels

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
