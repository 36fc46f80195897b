"""Poses at some times, in the formats that programs read; in JSON no file to save."""

from dataclasses import replace
from functools import partial
from typing import Any

from anyio import to_thread
from starlette.requests import Request
from starlette.responses import Response

from service.encode import POSE_ENCODERS, PoseEncoder
from service.encode.media import JSON
from service.motion.answer import PoseAnswer
from service.synthesis.exact.goals import Goals
from service.synthesis.synthesizer import Moments, Row, Synthesizer
from service.web import answers, body, query, service
from service.web.query import PoseQuestion
from service.web.service import Handler, Service


async def get_pose(encoder: PoseEncoder, served: Service, request: Request) -> Response:
    """Poses in the encoder's format, asked for by query parameters."""
    question = query.pose_of_pairs(query.pairs(request.scope["query_string"]))
    return await _answer(served, service.model(request), question, encoder)


async def query_pose(encoder: PoseEncoder, served: Service, request: Request) -> Response:
    """Poses in the encoder's format, asked for by a body."""
    content = await body.read(request, served.settings.body_limit)
    return await _answer(served, service.model(request), query.pose_of_body(content), encoder)


async def _answer(
    served: Service, model: Synthesizer, question: PoseQuestion, encoder: PoseEncoder
) -> Response:
    controls, times, policy = question.controls, question.times, question.extrapolate
    who, level, hold = question.performer, question.level, question.hold
    given = (controls, times, policy, who, level, hold)
    # Open controls are chosen by what the model makes of every captured clip.
    found = to_thread.run_sync(model.moments, *given) if hold.targets else None
    asked = model.moments(*given) if found is None else await found
    by_joint = question.joint_sigma
    goals = model.keeper.goals(asked.question, question.hold)
    if goals:
        content = await to_thread.run_sync(_held, model, asked, goals, question, encoder)
    elif len(times) > encoder.at_once:
        content = await to_thread.run_sync(_made, model, asked, encoder, by_joint)
    else:
        row = await served.batcher.row(model, asked)
        content = _encoded(model, asked, row, encoder, by_joint)
    if encoder.media_type == JSON:
        return Response(content, media_type=JSON)
    return answers.attachment(content, encoder.media_type, f"{model.name}.{encoder.extension}")


def _made(model: Synthesizer, asked: Moments, encoder: PoseEncoder, by_joint: bool) -> bytes:
    return _encoded(model, asked, model.poses([asked])[0], encoder, by_joint)


def _held(
    model: Synthesizer,
    asked: Moments,
    goals: Goals,
    question: PoseQuestion,
    encoder: PoseEncoder,
) -> bytes:
    answer = model.held_poses(asked, goals, question.extrapolate)
    return _with_joints(model, answer, encoder, question.joint_sigma)


def _encoded(
    model: Synthesizer, asked: Moments, row: Row, encoder: PoseEncoder, by_joint: bool
) -> bytes:
    return _with_joints(model, model.posed(asked, row), encoder, by_joint)


def _with_joints(
    model: Synthesizer, answer: PoseAnswer[Any], encoder: PoseEncoder, by_joint: bool
) -> bytes:
    trust = model.by_joint(answer.trust) if by_joint else answer.trust
    return encoder.encode(replace(answer, trust=trust))


OPERATIONS: dict[str, Handler] = {
    **{f"getPose{name.capitalize()}": partial(get_pose, e) for name, e in POSE_ENCODERS.items()},
    **{f"queryPose{n.capitalize()}": partial(query_pose, e) for n, e in POSE_ENCODERS.items()},
}
