"""Steps of requests for performances: one motion through a script, and an archive of many."""

import math
from collections.abc import Iterator, Sequence
from contextlib import AbstractAsyncContextManager
from dataclasses import dataclass
from typing import get_args

from starlette.requests import Request
from starlette.responses import Response

from posefield.batch import rows, scripts
from posefield.batch.scripts import ArchivedScript, PerformanceOrder
from posefield.characters import delivery
from posefield.characters.delivery import Delivery
from posefield.characters.user_character import EMPTY, CharacterFolder, UserCharacter
from posefield.common import cancellation
from posefield.common.errors import FormError, InvalidField, QueryError, did_you_mean
from posefield.encode import performance_files
from posefield.encode.archives import ARCHIVE_WRITERS, ArchiveWriter
from posefield.encode.conventions import Convention
from posefield.encode.formats import CLIP_ENCODERS, ClipEncoder, max_poses
from posefield.encode.performance_files import PerformanceEncoder
from posefield.http import responses, steps, worker_threads
from posefield.http.api import problems
from posefield.http.api.problems import BAD_PARAMETER, RequestError
from posefield.http.api.settings import Settings
from posefield.http.steps import Context, Steps, query_pairs, unlimited
from posefield.performance import composition
from posefield.performance.passage import RATE
from posefield.performance.script import Script, resolve_script
from posefield.question import json_decoding
from posefield.question.json_decoding import json_pointer
from posefield.question.performance_question import (
    Act,
    NamedScript,
    PerformanceLayout,
    PerformanceQuestion,
    PerformancesQuestion,
    Walk,
)
from posefield.question.performance_report import PerformanceAnswer, PerformanceReport
from posefield.registry.model_registry import ModelRegistry

REPEATED_NAME = "expected a name of its own: an earlier script has it, capitals count for nothing"


def decode_order(
    library: ModelRegistry,
    content: bytes,
    settings: Settings,
    characters: CharacterFolder = EMPTY,
) -> PerformanceOrder:
    """Return the planned order of a JSON body, which later steps do not refuse.

    Raises FormError for a malformed body, RequestError for an invalid script and InvalidField for a
    request beyond the limits.
    """
    body = json_decoding.decode_question(PerformancesQuestion, content)
    if body.format not in CLIP_ENCODERS:
        hint = did_you_mean(body.format, CLIP_ENCODERS)
        detail = f"{body.format!r}{hint}, expected one of {', '.join(CLIP_ENCODERS)}"
        raise FormError("format", detail)
    encoder = CLIP_ENCODERS[body.format]
    encode = performance_files.encoder(encoder, body.layout)
    _check_counts(body.scripts, settings)
    names = _names(body.scripts)
    character = None if body.character is None else characters.find(body.character)
    if character is not None:
        _check_character(body, encoder, character)
    scripts = zip(names, body.scripts, strict=True)
    own_joints = 0 if character is None else len(character.rig.skeleton)
    planned = tuple(_planned(library, encoder, scripts, settings, own_joints))
    if character is None:
        return PerformanceOrder(planned, encode)
    return PerformanceOrder(planned, encode, _archive_delivery(planned, encoder, character))


def _check_character(
    body: PerformancesQuestion, encoder: ClipEncoder, character: UserCharacter
) -> None:
    """Raise InvalidField, or RequestError for one script, for what a character's files lack."""
    for index, script in enumerate(body.scripts):
        try:
            order = delivery.deliver(character, encoder, script)
            character.target.check(script)
        except InvalidField as error:
            if error.field == "character":
                raise
            raise problems.nested_error(error, json_pointer("scripts", str(index))) from None
        order.check_layout(body.layout)


def _archive_delivery(
    planned: Sequence[ArchivedScript], encoder: ClipEncoder, character: UserCharacter
) -> Delivery:
    """Return the delivery of planned scripts, whose characters are checked."""
    found = delivery.deliver(character, encoder, planned[0].script.question)
    for index, own in enumerate(planned):
        try:
            found.check(
                own.script.question, own.script.character.skeleton, own.script.character.roles
            )
        except InvalidField as error:
            raise problems.nested_error(error, json_pointer("scripts", str(index))) from None
    return found


def _check_counts(scripts: Sequence[NamedScript], settings: Settings) -> None:
    if not 1 <= len(scripts) <= settings.performances_limit:
        expected = f"expected 1 to {settings.performances_limit}"
        raise InvalidField("scripts", f"{len(scripts)} scripts, {expected}")
    segments = sum(len(script.segments) for script in scripts)
    if segments > settings.performances_segments:
        expected = f"expected at most {settings.performances_segments}"
        raise InvalidField("scripts", f"{segments} segments in all, {expected}")


def _names(scripts: Sequence[NamedScript]) -> list[str]:
    """Return the names of the files without extension; RequestError for a repeated one."""
    names = [
        f"performance-{index:06d}" if script.name is None else script.name
        for index, script in enumerate(scripts)
    ]
    for index in rows.repeated_names(names):
        error = InvalidField("name", f"{names[index]!r}, {REPEATED_NAME}")
        raise problems.nested_error(error, json_pointer("scripts", str(index)))
    return names


def _planned(
    library: ModelRegistry,
    encoder: ClipEncoder,
    scripts: Iterator[tuple[str, NamedScript]],
    settings: Settings,
    own_joints: int,
) -> Iterator[ArchivedScript]:
    """Yield the planned scripts; InvalidField as soon as they are too long together.

    own_joints: of the character of a user; 0 without one.
    """
    seconds = 0.0
    for index, (name, question) in enumerate(scripts):
        cancellation.check()
        try:
            convention = encoder.convention(question.unit, question.up, question.body)
            script = resolve_script(question, library.find)
            joints = max(len(script.character.skeleton), own_joints)
            most = max_poses(settings.output_limit, joints, encoder)
            report = composition.plan(script, most)
        except QueryError as error:
            raise problems.nested_error(error, json_pointer("scripts", str(index))) from None
        seconds += report.duration
        if seconds > settings.performances_seconds:
            found = f"{seconds:.0f} s with script {index}"
            expected = f"expected at most {settings.performances_seconds} s in all"
            raise InvalidField("scripts", f"{found}, {expected}")
        file = f"{name}.{encoder.extension}"
        yield ArchivedScript(name, file, script, convention, most, bool(report.warnings))


MAX_SCRIPT_BYTES = 256 * 1024
LONG_SECONDS = 60.0
"""Duration at the rate of plans beyond which a performance takes tenths of a second and more."""
ACT_SECONDS, SLOW_WALK = 5.0, 0.5
"""Estimates of the duration of an act, s, and of the speed of a walk to a place, m/s."""
PLAN_FORMAT = "json"

Performances = Context[ClipEncoder]
Packs = Context[ArchiveWriter]


@dataclass(frozen=True)
class ScriptRequest:
    """A decoded script.

    plan: whether the answer is the plan alone. layout: of USD files. character: of a user; None for
    that of the script.
    """

    question: PerformanceQuestion
    plan: bool
    layout: PerformanceLayout
    character: str | None = None


@dataclass(frozen=True)
class PerformanceTask:
    """A script whose models are known, and the limits of its format.

    most: largest number of frames. convention: unit and up axis of the file. encode: writes it.
    delivery: to a character of a user.
    """

    script: Script
    plan: bool
    most: int
    convention: Convention
    encode: PerformanceEncoder
    delivery: Delivery | None = None


async def decode(context: Performances, request: Request) -> ScriptRequest:
    """Return the script of a body; raises RequestError for a plan in another format than JSON."""
    query = dict(query_pairs(request.scope["query_string"]))
    plan, layout = _wants_plan(context, query), _layout(query)
    content = await steps.read_body(request, MAX_SCRIPT_BYTES, context.service.bodies)
    question = json_decoding.decode_question(PerformanceQuestion, content)
    character = query.get("character")
    if plan and character is not None:
        detail = "character: given with plan=true, expected without: a plan moves no character"
        raise RequestError(BAD_PARAMETER, detail, {"parameter": "character"})
    return ScriptRequest(question, plan, layout, character)


def _wants_plan(context: Performances, query: dict[str, str]) -> bool:
    given = query.get("plan", "false")
    place = {"parameter": "plan"}
    if given not in ("true", "false"):
        raise RequestError(BAD_PARAMETER, f"plan: {given!r}, expected true or false", place)
    if given == "true" and context.form.extension != PLAN_FORMAT:
        found = context.form.extension
        detail = f"plan: true in the format {found}, expected the format {PLAN_FORMAT}"
        raise RequestError(BAD_PARAMETER, detail, place)
    return given == "true"


def _layout(query: dict[str, str]) -> PerformanceLayout:
    given, known = query.get("layout", "whole"), get_args(PerformanceLayout)
    found: PerformanceLayout | None = next((each for each in known if each == given), None)
    if found is None:
        detail = f"layout: {given!r}, expected one of {', '.join(known)}"
        raise RequestError(BAD_PARAMETER, detail, {"parameter": "layout"})
    return found


async def validate(context: Performances, asked: ScriptRequest) -> PerformanceTask:
    """Return the script with its models; raises QueryError with a pointer into the script."""
    question, encoder = asked.question, context.form
    try:
        write = performance_files.encoder(encoder, asked.layout)
    except InvalidField as fault:
        raise problems.parameter_error(fault) from None
    order = _delivery(context, asked)
    if order is None:
        convention = encoder.convention(question.unit, question.up, question.body)
    else:
        convention = order.convention
    script = resolve_script(question, context.library.find)
    joints = len(script.character.skeleton)
    if order is not None:
        order.check(question, script.character.skeleton, script.character.roles)
        joints = max(joints, order.joints)
    most = max_poses(context.service.settings.output_limit, joints, encoder)
    return PerformanceTask(script, asked.plan, most, convention, write, order)


def _delivery(context: Performances, asked: ScriptRequest) -> Delivery | None:
    """Return the delivery to a character of a user; None for the character of the script."""
    if asked.character is None:
        return None
    try:
        character = context.service.characters.find(asked.character)
        found = delivery.deliver(character, context.form, asked.question)
        found.check_layout(asked.layout)
    except InvalidField as fault:
        if fault.field in ("character", "layout"):
            raise problems.parameter_error(fault) from None
        raise
    return found


def places(context: Performances, task: PerformanceTask) -> AbstractAsyncContextManager[None]:
    """Return the limit on short or on long performances, by an estimate of their frames."""
    question = task.script.question
    frames = max(question.fps, RATE) * _expected_seconds(question)
    long = frames > LONG_SECONDS * RATE
    return worker_threads.LONG_LIMITER if long else worker_threads.PERFORMANCE_LIMITER


def _expected_seconds(question: PerformanceQuestion) -> float:
    """Return a rough upper bound of the duration, s, that is known before it is planned."""
    found, place = 0.0, question.start.position
    for own in question.segments:
        found += ACT_SECONDS if isinstance(own, Act) else own.seconds or 0.0
        ways = [*(own.along or ()), *([own.to] if own.to else [])] if isinstance(own, Walk) else []
        for point in ways:
            found, place = found + math.dist(place, point) / SLOW_WALK, point
    return found


async def synthesise(
    context: Performances, task: PerformanceTask
) -> PerformanceAnswer | PerformanceReport:
    """Return the performance as a clip, or its plan."""
    if task.plan:
        return await worker_threads.within(composition.plan, task.script, task.most)
    return await worker_threads.within(_performed, task)


def _performed(task: PerformanceTask) -> PerformanceAnswer:
    answer = composition.perform(task.script, task.most)
    if task.delivery is None:
        return answer
    return task.delivery.performance(answer, task.script.character.roles)


async def encode(
    context: Performances, task: PerformanceTask, answer: PerformanceAnswer | PerformanceReport
) -> bytes:
    """Return the performance as a file, or its plan as JSON."""
    if isinstance(answer, PerformanceReport):
        return composition.plan_document(answer)
    if task.delivery is not None:
        return await worker_threads.within(task.delivery.encode, answer)
    return await worker_threads.within(task.encode, answer, task.convention)


def respond(
    context: Performances, answer: PerformanceAnswer | PerformanceReport, content: bytes
) -> Response:
    """Return the response, with the facts of the report in its headers."""
    report = answer if isinstance(answer, PerformanceReport) else answer.trust
    return responses.performance_file(content, context.form, report)


QUERY_PERFORMANCE = Steps(
    {PLAN_FORMAT: CLIP_ENCODERS[PLAN_FORMAT], **CLIP_ENCODERS},
    decode,
    validate,
    places,
    synthesise,
    encode,
    respond,
)


async def read_scripts(context: Packs, request: Request) -> bytes:
    """Return the body of a request for many performances."""
    service = context.service
    return await steps.read_body(request, service.settings.clips_body_limit, service.bodies)


async def plan_scripts(context: Packs, content: bytes) -> PerformanceOrder:
    """Return the planned scripts of a body, which later steps do not refuse."""
    return await worker_threads.run_in_thread(
        decode_order,
        context.library,
        content,
        context.service.settings,
        context.service.characters,
        places=worker_threads.ARCHIVE_LIMITER,
    )


async def perform_scripts(context: Packs, order: PerformanceOrder) -> Iterator[tuple[str, bytes]]:
    """Return an iterator over the names and files of the performances, made as they are sent."""
    return scripts.archive_members(order)


async def pack_performances(
    context: Packs, order: PerformanceOrder, members: Iterator[tuple[str, bytes]]
) -> tuple[Iterator[bytes], list[str]]:
    """Return the pieces of the archive, and its warnings."""
    return responses.merged_chunks(context.form.write(members)), order.warnings


def send_performances(
    context: Packs, members: object, content: tuple[Iterator[bytes], list[str]]
) -> Response:
    """Return the response that streams the archive."""
    pieces, warnings = content
    sent = responses.sent(pieces, worker_threads.LONG_LIMITER)
    return responses.performance_archive(sent, context.form, warnings)


QUERY_PERFORMANCES = Steps(
    ARCHIVE_WRITERS,
    read_scripts,
    plan_scripts,
    unlimited,
    perform_scripts,
    pack_performances,
    send_performances,
)
