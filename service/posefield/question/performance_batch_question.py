"""Many scripts of performances in one request, and the layout of their files."""

from typing import Literal

from msgspec import Struct

from posefield.question.motion_question import Name
from posefield.question.performance_question import PerformanceQuestion

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
