"""Poses at some times, in the formats that programs read; in JSON no file to save."""

from functools import partial

from anyio import to_thread
from starlette.requests import Request
from starlette.responses import Response

from service.encode import POSE_ENCODERS, PoseEncoder
from service.encode.media import JSON
from service.synthesis import poses
from service.synthesis.exact.goals import Goals
from service.synthesis.poses import Moments
from service.synthesis.question import PoseQuestion
from service.synthesis.synthesizer import Synthesizer
from service.web import answers, body, query, service
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
    if question.hold.targets:
        # Open controls are chosen by what the model makes of every captured clip.
        asked = await to_thread.run_sync(poses.moments, model, question)
    else:
        asked = poses.moments(model, question)
    goals = model.keeper.goals(asked.question, question.hold)
    if goals:
        content = await to_thread.run_sync(_held, model, asked, goals, encoder)
    elif len(question.times) > encoder.at_once:
        content = await to_thread.run_sync(_made, model, asked, encoder)
    else:
        row = await served.batcher.row(model, asked)
        content = encoder.encode(poses.posed(model, asked, row))
    if encoder.media_type == JSON:
        return Response(content, media_type=JSON)
    return answers.attachment(content, encoder.media_type, f"{model.name}.{encoder.extension}")


def _held(model: Synthesizer, asked: Moments, goals: Goals, encoder: PoseEncoder) -> bytes:
    return encoder.encode(poses.held(model, asked, goals))


def _made(model: Synthesizer, asked: Moments, encoder: PoseEncoder) -> bytes:
    return encoder.encode(poses.posed(model, asked, poses.rows(model, [asked])[0]))


OPERATIONS: dict[str, Handler] = {
    **{f"getPose{name.capitalize()}": partial(get_pose, e) for name, e in POSE_ENCODERS.items()},
    **{f"queryPose{n.capitalize()}": partial(query_pose, e) for n, e in POSE_ENCODERS.items()},
}
