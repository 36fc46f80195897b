"""Steps of requests for performances: one motion through a script, and an archive of many."""

from collections.abc import Iterator
from contextlib import AbstractAsyncContextManager
from dataclasses import dataclass
from typing import get_args

from starlette.requests import Request
from starlette.responses import Response

from posefield.batch import scripts
from posefield.batch.scripts import PerformanceOrder
from posefield.characters import delivery
from posefield.characters.delivery import Delivery
from posefield.common.errors import InvalidField
from posefield.encode import performance_files
from posefield.encode.archives import ARCHIVE_WRITERS, ArchiveWriter
from posefield.encode.files.file_convention import Convention
from posefield.encode.formats import CLIP_ENCODERS, ClipEncoder, max_poses
from posefield.encode.performance_files import PerformanceEncoder
from posefield.http import responses
from posefield.http.api import problems
from posefield.http.api.problems import BAD_PARAMETER, RequestError
from posefield.http.concurrency import worker_threads
from posefield.http.decoding import performances_query, request_body
from posefield.http.steps import Context, Steps, query_pairs, unlimited
from posefield.performance import composition
from posefield.performance.script import Script, resolve_script
from posefield.question import json_decoding
from posefield.question.performance_batch_question import PerformanceLayout
from posefield.question.performance_question import PerformanceQuestion
from posefield.question.performance_report import PerformanceAnswer, PerformanceReport

MAX_SCRIPT_BYTES = 256 * 1024
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
    content = await request_body.read_body(request, MAX_SCRIPT_BYTES, context.service.bodies)
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
    write = _encoder(encoder, asked.layout)
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
    most = max_poses(context.service.settings.output_limit, joints, encoder.bytes_per_joint)
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


def _encoder(form: ClipEncoder, layout: PerformanceLayout) -> PerformanceEncoder:
    try:
        return performance_files.encoder(form, layout)
    except InvalidField as fault:
        raise problems.parameter_error(fault) from None


def places(context: Performances, task: PerformanceTask) -> AbstractAsyncContextManager[None]:
    """Return the limit on requests that the constraint solver answers."""
    return worker_threads.SOLVER_LIMITER


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
    return await request_body.read_body(request, service.settings.clips_body_limit, service.bodies)


async def plan_scripts(context: Packs, content: bytes) -> PerformanceOrder:
    """Return the planned scripts of a body, which later steps do not refuse."""
    return await worker_threads.run_in_thread(
        performances_query.decode_order,
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
    sent = responses.sent(pieces, worker_threads.ARCHIVE_LIMITER)
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
