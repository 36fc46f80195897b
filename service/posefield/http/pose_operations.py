"""Handlers of pose requests; formats other than JSON are sent as attachments."""

from typing import Any

from starlette.requests import Request
from starlette.responses import Response

from posefield.constraints.targets import Goals
from posefield.encode.files.media_types import JSON
from posefield.encode.formats import TableEncoder
from posefield.http import responses, service
from posefield.http.concurrency import worker_threads
from posefield.http.decoding import request_questions
from posefield.http.service import Service
from posefield.question.motion_question import PoseQuestion
from posefield.question.results import PoseAnswer
from posefield.synthesis import poses
from posefield.synthesis.poses import Moments
from posefield.synthesis.synthesizer import Synthesizer

PoseEncoder = TableEncoder[PoseAnswer[Any]]


async def get_pose(encoder: PoseEncoder, served: Service, request: Request) -> Response:
    """Return poses for the query parameters."""
    question = request_questions.of_url(PoseQuestion, request)
    return await _answer(served, service.model(request), question, encoder)


async def query_pose(encoder: PoseEncoder, served: Service, request: Request) -> Response:
    """Return poses for a JSON body."""
    question = await request_questions.of_body(
        PoseQuestion, request, served.settings.body_limit, served.bodies
    )
    return await _answer(served, service.model(request), question, encoder)


async def _answer(
    served: Service, model: Synthesizer, question: PoseQuestion, encoder: PoseEncoder
) -> Response:
    if question.targets:
        # Open controls are inferred from predictions of every captured clip, which takes time.
        asked = await worker_threads.run(
            poses.moments, model, question, places=worker_threads.SOLVER
        )
    else:
        asked = poses.moments(model, question)
    goals = model.keeper.goals(asked.question, question)
    if goals:
        content = await worker_threads.run(
            _held, model, asked, goals, encoder, places=worker_threads.SOLVER
        )
    elif len(question.times) > encoder.at_once:
        content = await worker_threads.run(_made, model, asked, encoder)
    else:
        row = await served.batcher.row(model, asked)
        content = encoder.encode(poses.posed(model, asked, row))
    if encoder.media_type == JSON:
        return Response(content, media_type=JSON)
    return responses.attachment(content, encoder, model.name)


def _held(model: Synthesizer, asked: Moments, goals: Goals, encoder: PoseEncoder) -> bytes:
    return encoder.encode(poses.held(model, asked, goals))


def _made(model: Synthesizer, asked: Moments, encoder: PoseEncoder) -> bytes:
    return encoder.encode(poses.posed(model, asked, poses.rows(model, [asked])[0]))
