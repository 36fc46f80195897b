"""Requests for performances: one motion through a script, its plan, and archives of many."""

from collections.abc import Iterable, Mapping
from functools import partial
from typing import Any, Literal, TypedDict, TypeVar, Unpack, get_type_hints
from urllib.parse import urlencode

import msgspec
from msgspec import Struct, structs

from posefield_client import asking, scripts
from posefield_client.errors import WrongQuestion
from posefield_client.files import Body, ClipFormat, Feet, Files, Names
from posefield_client.generated import (
    OPERATIONS,
    CharacterChoice,
    NamedScript,
    Obstacle,
    PerformanceEntry,
    PerformanceQuestion,
    PerformanceReport,
    PerformancesQuestion,
    PerformanceStart,
)
from posefield_client.questions import Extrapolate
from posefield_client.scripts import Script
from posefield_client.wire import Call, Reply, Request

AnyScript = Script | PerformanceQuestion | Mapping[str, Any]
"""A script, or a document of one as the contract has it."""
Layout = Literal["whole", "segments"]
"""Animations in USD files: one of the whole performance, or besides it one of each segment."""
PERFORMANCE, ARCHIVES = (
    tuple(OPERATIONS[f"query{name}InFormat"].formats) for name in ("Performance", "Performances")
)
Form = TypeVar("Form", PerformanceQuestion, NamedScript)


class ScriptOptions(TypedDict, total=False):
    """Options of a script besides its segments."""

    character: CharacterChoice | Mapping[str, Any] | None
    start: PerformanceStart | Mapping[str, Any] | None
    obstacles: Iterable[Obstacle | Mapping[str, Any]] | None
    fps: float | None
    take: int | None
    variety: float | None
    detail: bool | None
    level: int | None
    feet: Feet | None
    extrapolate: Extrapolate | None


class FileOptions(ScriptOptions, total=False):
    """Options of a script and of its file."""

    names: Names | None
    unit: Literal["m", "cm"] | None
    up: Literal["y", "z"] | None
    body: Body | None


def performance(
    script: AnyScript,
    /,
    *,
    layout: Layout | None = None,
    user_character: str | None = None,
    **options: Unpack[FileOptions],
) -> Files:
    """Return a performance; the request is sent when it is saved or its numbers are read.

    layout: "segments" adds an animation of each segment to USD files. user_character: name of a
    character of the service, one of `characters()`, that moves instead of that of the script.
    """
    question = read_script(script, _said(options, FileOptions))
    said = asking.said(layout=layout, character=user_character)
    query = "?" + urlencode(said) if said else ""
    ask = partial(_request, question, query)
    return Files(PERFORMANCE, ask, about=repr(Script(question.segments)))


def plan(script: AnyScript, /, **options: Unpack[ScriptOptions]) -> Call[PerformanceReport]:
    """Return the plan of a performance: timeline, joins, targets and warnings, without poses."""
    operation = OPERATIONS["queryPerformance"]
    content = _content(read_script(script, _said(options, ScriptOptions)))
    return Call(Request(operation, f"{operation.path}?plan=true", content), _plan)


def _said(options: Mapping[str, Any], known: type[ScriptOptions]) -> dict[str, Any]:
    """Return the options that are given, as JSON values; WrongQuestion for an unknown one."""
    names = get_type_hints(known)
    if unknown := next((name for name in options if name not in names), None):
        hint = asking.did_you_mean(unknown, names)
        raise WrongQuestion(f"option {unknown!r}{hint}, expected some of {', '.join(names)}")
    discs = options.get("obstacles")
    listed = {} if discs is None else {"obstacles": tuple(discs)}
    return asking.said(**{**options, **listed})


def performances(
    scripts: Iterable[AnyScript | NamedScript],
    format: ClipFormat,  # noqa: A002  # the contract's own word
    *,
    layout: Layout | None = None,
    user_character: str | None = None,
) -> Files:
    """Return an archive of many performances of one format, with a manifest.

    A script may have a `name`, that of its file. layout, user_character: as for `performance`.
    """
    if format not in PERFORMANCE:
        hint = asking.did_you_mean(format, PERFORMANCE)
        raise WrongQuestion(f"format {format!r}{hint}, expected one of {', '.join(PERFORMANCE)}")
    listed = tuple(_named(place, script) for place, script in enumerate(scripts))
    question = PerformancesQuestion(
        format=format, scripts=listed, **asking.said(layout=layout, character=user_character)
    )
    about = f"{len(listed)} performances as {format}"
    return Files(ARCHIVES, partial(_archive, question), len(listed), about, PerformanceEntry)


def _named(place: int, script: AnyScript | NamedScript) -> NamedScript:
    try:
        return _read(script, {}, NamedScript)
    except WrongQuestion as fault:
        raise WrongQuestion(f"script {place}: {fault}") from None


def _archive(question: PerformancesQuestion, form: str) -> Request:
    operation = OPERATIONS["queryPerformancesInFormat"].in_format(form)
    return Request(operation, operation.path, _content(question))


def read_script(script: AnyScript, options: Mapping[str, Any]) -> PerformanceQuestion:
    """Return the question of a script with options; WrongQuestion if it is invalid."""
    return _read(script, options, PerformanceQuestion)


def _read(script: AnyScript | NamedScript, options: Mapping[str, Any], form: type[Form]) -> Form:
    given = _document(script)
    listed = given.get("segments")
    if not isinstance(listed, list) or not listed:
        raise WrongQuestion("a script without segments, expected at least one")
    for place, each in enumerate(listed):
        scripts.read_segment(f"segment {place}", each)
    try:
        return msgspec.convert(asking.together(given, options), form)
    except msgspec.ValidationError as fault:
        raise WrongQuestion(f"script: {fault}{_known_keys(given, form)}") from None


def _document(script: AnyScript | NamedScript) -> dict[str, Any]:
    if isinstance(script, Script):
        return script.document()
    if not isinstance(script, Mapping | PerformanceQuestion | NamedScript):
        found = type(script).__name__
        raise WrongQuestion(f"script is a {found}, expected a Script or a mapping with segments")
    plain: dict[str, Any] = asking.sayable("script", script)
    return plain


def _known_keys(given: Mapping[str, Any], form: type[Struct]) -> str:
    """Return the name that is most like an unknown key of a script, or ""."""
    known = [field.name for field in structs.fields(form)]
    unknown = [key for key in given if key not in known]
    return asking.did_you_mean(str(unknown[0]), known) if unknown else ""


def _request(question: PerformanceQuestion, query: str, form: str) -> Request:
    operation = OPERATIONS["queryPerformanceInFormat"].in_format(form)
    return Request(operation, operation.path + query, _content(question))


def _content(question: PerformanceQuestion | PerformancesQuestion) -> bytes:
    return msgspec.json.encode(asking.sayable("script", question))


class _Planned(Struct, frozen=True):
    trust: PerformanceReport


_PLANNED = msgspec.json.Decoder(_Planned)


def _plan(reply: Reply) -> PerformanceReport:
    return _PLANNED.decode(reply.content).trust
