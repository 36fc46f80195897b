"""Operation that answers with a performance: one motion through a script, or its plan."""

import math
from typing import get_args

from starlette.responses import Response

from posefield.characters import delivery
from posefield.characters.delivery import Delivery
from posefield.common.errors import InvalidField
from posefield.encode import formats
from posefield.encode.formats import CLIP_ENCODERS, ClipEncoder, max_poses
from posefield.http import responses
from posefield.http.api import problems
from posefield.http.api.problems import BAD_PARAMETER, RequestError
from posefield.http.batching import LONG_LIMITER, PERFORMANCE_LIMITER, run_in_thread
from posefield.http.request import ServiceRequest, query_pairs, read_body
from posefield.performance import composition
from posefield.performance.passage import RATE
from posefield.performance.script import resolve_script
from posefield.question import json_decoding
from posefield.question.performance_question import (
    Act,
    PerformanceLayout,
    PerformanceQuestion,
    Walk,
)
from posefield.question.performance_report import PerformanceReport

MAX_SCRIPT_BYTES = 256 * 1024
LONG_SECONDS = 60.0
"""Duration at the rate of plans beyond which a performance takes tenths of a second and more."""
ACT_SECONDS, SLOW_WALK = 5.0, 0.5
"""Estimates of the duration of an act, s, and of the speed of a walk to a place, m/s."""
PLAN_FORMAT = "json"
PERFORMANCE_FORMATS = {PLAN_FORMAT: CLIP_ENCODERS[PLAN_FORMAT], **CLIP_ENCODERS}


async def answer_performance(request: ServiceRequest) -> Response:
    """Answer with a performance, or with its plan alone, and facts of its report in headers.

    Raises QueryError with a pointer into the script, and RequestError for a query parameter.
    """
    encoder, query = CLIP_ENCODERS[request.format], dict(query_pairs(request["query_string"]))
    plan, layout, character = _is_plan(query, encoder), _layout(query), query.get("character")
    content = await read_body(request, MAX_SCRIPT_BYTES, request.service.bodies)
    question = json_decoding.decode_question(PerformanceQuestion, content)
    if plan and character is not None:
        detail = "character: given with plan=true, expected without: a plan moves no character"
        raise RequestError(BAD_PARAMETER, detail, {"parameter": "character"})
    try:
        encode = formats.performance_encoder(encoder, layout)
    except InvalidField as fault:
        raise problems.parameter_error(fault) from None
    order = None
    if character is not None:
        order = _delivery(request, character, encoder, question, layout)
        convention = order.convention
    else:
        convention = encoder.convention(question.unit, question.up, question.body)
    script = resolve_script(question, request.library.find)
    skeleton, roles = script.character.skeleton, script.character.roles
    joints = len(skeleton)
    if order is not None:
        order.check(question, skeleton, roles)
        joints = max(joints, order.joints)
    longest = max_poses(request.service.settings.output_limit, joints, encoder)

    def work() -> tuple[PerformanceReport, bytes]:
        if plan:
            report = composition.plan(script, longest)
            return report, composition.plan_document(report)
        answer = composition.perform(script, longest)
        if order is None:
            return answer.trust, encode(answer, convention)
        answer = order.performance(answer, roles)
        return answer.trust, order.encode(answer)

    frames = max(question.fps, RATE) * _expected_seconds(question)
    limiter = LONG_LIMITER if frames > LONG_SECONDS * RATE else PERFORMANCE_LIMITER
    report, content = await run_in_thread(work, limiter=limiter)
    return responses.performance_file(content, encoder, report)


def _is_plan(query: dict[str, str], encoder: ClipEncoder) -> bool:
    plan, location = query.get("plan", "false"), {"parameter": "plan"}
    if plan not in ("true", "false"):
        raise RequestError(BAD_PARAMETER, f"plan: {plan!r}, expected true or false", location)
    if plan == "true" and encoder.extension != PLAN_FORMAT:
        extension = encoder.extension
        detail = f"plan: true in the format {extension}, expected the format {PLAN_FORMAT}"
        raise RequestError(BAD_PARAMETER, detail, location)
    return plan == "true"


def _layout(query: dict[str, str]) -> PerformanceLayout:
    name, layouts = query.get("layout", "whole"), get_args(PerformanceLayout)
    if name not in layouts:
        detail = f"layout: {name!r}, expected one of {', '.join(layouts)}"
        raise RequestError(BAD_PARAMETER, detail, {"parameter": "layout"})
    return layouts[layouts.index(name)]  # type: ignore[no-any-return]


def _delivery(
    request: ServiceRequest,
    character: str,
    encoder: ClipEncoder,
    question: PerformanceQuestion,
    layout: PerformanceLayout,
) -> Delivery:
    try:
        order = delivery.deliver(request.service.characters.find(character), encoder, question)
        order.check_layout(layout)
    except InvalidField as fault:
        if fault.field in ("character", "layout"):
            raise problems.parameter_error(fault) from None
        raise
    return order


def _expected_seconds(question: PerformanceQuestion) -> float:
    """Return a rough upper bound of the duration, s, that is known before it is planned."""
    seconds, position = 0.0, question.start.position
    for segment in question.segments:
        seconds += ACT_SECONDS if isinstance(segment, Act) else segment.seconds or 0.0
        if isinstance(segment, Walk):
            for point in [*(segment.along or ()), *([segment.to] if segment.to else [])]:
                seconds += math.dist(position, point) / SLOW_WALK
                position = point
    return seconds
