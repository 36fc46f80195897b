"""Handlers of pose requests; formats other than JSON are sent as attachments."""

from typing import Any

from starlette.requests import Request
from starlette.responses import Response

from service.encode import TableEncoder
from service.encode.media import JSON
from service.motion.answer import PoseAnswer
from service.question.motion_question import PoseQuestion
from service.synthesis import poses
from service.synthesis.exact.goals import Goals
from service.synthesis.poses import Moments
from service.synthesis.synthesizer import Synthesizer
from service.web import answers, questions, service, threads
from service.web.service import Service

PoseEncoder = TableEncoder[PoseAnswer[Any]]


async def get_pose(encoder: PoseEncoder, served: Service, request: Request) -> Response:
    """Return poses for the query parameters."""
    question = questions.of_url(PoseQuestion, request)
    return await _answer(served, service.model(request), question, encoder)


async def query_pose(encoder: PoseEncoder, served: Service, request: Request) -> Response:
    """Return poses for a JSON body."""
    question = await questions.of_body(PoseQuestion, served, request)
    return await _answer(served, service.model(request), question, encoder)


async def _answer(
    served: Service, model: Synthesizer, question: PoseQuestion, encoder: PoseEncoder
) -> Response:
    if question.targets:
        # Open controls are inferred from predictions of every captured clip, which takes time.
        asked = await threads.run(poses.moments, model, question, places=threads.SOLVER)
    else:
        asked = poses.moments(model, question)
    goals = model.keeper.goals(asked.question, question)
    if goals:
        content = await threads.run(_held, model, asked, goals, encoder, places=threads.SOLVER)
    elif len(question.times) > encoder.at_once:
        content = await threads.run(_made, model, asked, encoder)
    else:
        row = await served.batcher.row(model, asked)
        content = encoder.encode(poses.posed(model, asked, row))
    if encoder.media_type == JSON:
        return Response(content, media_type=JSON)
    return answers.attachment(content, encoder, model.name)


def _held(model: Synthesizer, asked: Moments, goals: Goals, encoder: PoseEncoder) -> bytes:
    return encoder.encode(poses.held(model, asked, goals))


def _made(model: Synthesizer, asked: Moments, encoder: PoseEncoder) -> bytes:
    return encoder.encode(poses.posed(model, asked, poses.rows(model, [asked])[0]))
