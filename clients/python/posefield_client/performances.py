"""Requests for performances: one motion through the segments of a script, and its plan."""

from collections.abc import Iterable, Mapping
from functools import partial
from typing import Any, Literal

import msgspec
from msgspec import Struct, structs

from posefield_client import asking, scripts
from posefield_client.errors import WrongQuestion
from posefield_client.files import Body, Feet, Files, Names
from posefield_client.generated import (
    OPERATIONS,
    CharacterChoice,
    Obstacle,
    PerformanceQuestion,
    PerformanceReport,
    PerformanceStart,
)
from posefield_client.questions import Extrapolate
from posefield_client.scripts import Script
from posefield_client.wire import Call, Reply, Request

AnyScript = Script | PerformanceQuestion | Mapping[str, Any]
"""A script, or a document of one as the contract has it."""
PERFORMANCE = tuple(OPERATIONS["queryPerformanceInFormat"].formats)


def performance(
    script: AnyScript,
    /,
    *,
    character: CharacterChoice | Mapping[str, Any] | None = None,
    start: PerformanceStart | Mapping[str, Any] | None = None,
    obstacles: Iterable[Obstacle | Mapping[str, Any]] | None = None,
    fps: float | None = None,
    take: int | None = None,
    variety: float | None = None,
    detail: bool | None = None,
    level: int | None = None,
    feet: Feet | None = None,
    extrapolate: Extrapolate | None = None,
    names: Names | None = None,
    unit: Literal["m", "cm"] | None = None,
    up: Literal["y", "z"] | None = None,
    body: Body | None = None,
) -> Files:
    """Return a performance; the request is sent when it is saved or its numbers are read."""
    discs = None if obstacles is None else tuple(obstacles)
    options = {
        **asking.said(character=character, start=start, obstacles=discs, fps=fps),
        **asking.said(take=take, variety=variety, detail=detail, level=level, feet=feet),
        **asking.said(extrapolate=extrapolate, names=names, unit=unit, up=up, body=body),
    }
    question = read_script(script, options)
    ask = partial(_request, question)
    return Files(PERFORMANCE, ask, about=repr(Script(question.segments)))


def plan(
    script: AnyScript,
    /,
    *,
    character: CharacterChoice | Mapping[str, Any] | None = None,
    start: PerformanceStart | Mapping[str, Any] | None = None,
    obstacles: Iterable[Obstacle | Mapping[str, Any]] | None = None,
    fps: float | None = None,
    take: int | None = None,
    variety: float | None = None,
    detail: bool | None = None,
    level: int | None = None,
    feet: Feet | None = None,
    extrapolate: Extrapolate | None = None,
) -> Call[PerformanceReport]:
    """Return the plan of a performance: timeline, joins, targets and warnings, without poses."""
    discs = None if obstacles is None else tuple(obstacles)
    options = {
        **asking.said(character=character, start=start, obstacles=discs, fps=fps),
        **asking.said(take=take, variety=variety, detail=detail, level=level, feet=feet),
        **asking.said(extrapolate=extrapolate),
    }
    operation = OPERATIONS["queryPerformance"]
    content = _content(read_script(script, options))
    return Call(Request(operation, f"{operation.path}?plan=true", content), _plan)


def read_script(script: AnyScript, options: Mapping[str, Any]) -> PerformanceQuestion:
    """Return the question of a script with options; WrongQuestion if it is invalid."""
    given = _document(script)
    listed = given.get("segments")
    if not isinstance(listed, list) or not listed:
        raise WrongQuestion("a script without segments, expected at least one")
    for place, each in enumerate(listed):
        scripts.read_segment(f"segment {place}", each)
    try:
        return msgspec.convert(asking.together(given, options), PerformanceQuestion)
    except msgspec.ValidationError as fault:
        raise WrongQuestion(f"script: {fault}{_known_keys(given)}") from None


def _document(script: AnyScript) -> dict[str, Any]:
    if isinstance(script, Script):
        return script.document()
    if not isinstance(script, Mapping | PerformanceQuestion):
        found = type(script).__name__
        raise WrongQuestion(f"script is a {found}, expected a Script or a mapping with segments")
    plain: dict[str, Any] = asking.sayable("script", script)
    return plain


def _known_keys(given: Mapping[str, Any]) -> str:
    """Return the name that is most like an unknown key of a script, or ""."""
    known = [field.name for field in structs.fields(PerformanceQuestion)]
    unknown = [key for key in given if key not in known]
    return asking.did_you_mean(str(unknown[0]), known) if unknown else ""


def _request(question: PerformanceQuestion, form: str) -> Request:
    operation = OPERATIONS["queryPerformanceInFormat"].in_format(form)
    return Request(operation, operation.path, _content(question))


def _content(question: PerformanceQuestion) -> bytes:
    return msgspec.json.encode(asking.sayable("script", question))


class _Planned(Struct, frozen=True):
    trust: PerformanceReport


_PLANNED = msgspec.json.Decoder(_Planned)


def _plan(reply: Reply) -> PerformanceReport:
    return _PLANNED.decode(reply.content).trust
