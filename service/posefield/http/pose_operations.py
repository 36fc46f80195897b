"""Steps of pose requests; formats other than JSON are sent as attachments."""

from contextlib import AbstractAsyncContextManager, nullcontext
from dataclasses import dataclass
from functools import partial
from typing import Any

from starlette.responses import Response

from posefield.constraints.targets import Goals
from posefield.encode.files.media_types import JSON
from posefield.encode.formats import POSE_ENCODERS, TableEncoder
from posefield.http import responses
from posefield.http.concurrency import worker_threads
from posefield.http.steps import Context, Steps, from_body, from_url
from posefield.question.motion_question import PoseQuestion
from posefield.question.results import PoseAnswer
from posefield.synthesis import poses
from posefield.synthesis.poses import Moments

Poses = Context[TableEncoder[PoseAnswer[Any]]]


@dataclass(frozen=True)
class PoseTask:
    """A validated question for poses.

    goals: its constraints. apart: true if synthesis and encoding take a thread.
    """

    moments: Moments
    goals: Goals
    apart: bool


async def validate(context: Poses, question: PoseQuestion) -> PoseTask:
    """Return the question with its controls, times and constraints checked."""
    model = context.model
    if question.targets:
        # Open controls are inferred from predictions of every captured clip, which takes time.
        asked = await worker_threads.run(
            poses.moments, model, question, places=worker_threads.SOLVER
        )
    else:
        asked = poses.moments(model, question)
    goals = model.keeper.goals(asked.question, question)
    return PoseTask(asked, goals, bool(goals) or len(question.times) > context.form.at_once)


def places(context: Poses, task: PoseTask) -> AbstractAsyncContextManager[None]:
    """Return the limit on requests that take a thread."""
    if not task.apart:
        return nullcontext()
    return worker_threads.SOLVER if task.goals else worker_threads.WORK


async def synthesise(context: Poses, task: PoseTask) -> PoseAnswer[Any]:
    """Return the poses: of the constraint solver, of the graph, or of a batch of requests."""
    model, moments = context.model, task.moments
    if task.goals:
        return await worker_threads.within(poses.held, model, moments, task.goals)
    if task.apart:
        (row,) = await worker_threads.within(poses.rows, model, [moments])
    else:
        row = await context.service.batcher.row(model, moments)
    return poses.posed(model, moments, row)


async def encode(context: Poses, task: PoseTask, answer: PoseAnswer[Any]) -> bytes:
    """Return the poses as bytes."""
    if task.apart:
        return await worker_threads.within(context.form.encode, answer)
    return context.form.encode(answer)


def respond(context: Poses, answer: PoseAnswer[Any], content: bytes) -> Response:
    """Return the response."""
    if context.form.media_type == JSON:
        return Response(content, media_type=JSON)
    return responses.attachment(content, context.form, context.model.name)


_steps = partial(
    Steps[TableEncoder[PoseAnswer[Any]], PoseQuestion, PoseTask, PoseAnswer[Any], bytes],
    POSE_ENCODERS,
    validate=validate,
    places=places,
    synthesise=synthesise,
    encode=encode,
    respond=respond,
)
GET_POSE = _steps(decode=from_url(PoseQuestion))
QUERY_POSE = _steps(decode=from_body(PoseQuestion))
