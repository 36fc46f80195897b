"""Steps of pose requests; formats other than JSON are sent as attachments."""

from contextlib import AbstractAsyncContextManager, nullcontext
from dataclasses import dataclass
from functools import partial
from typing import Any

from starlette.responses import Response

from posefield.constraints.targets import ConstraintSet
from posefield.encode.conventions import JSON
from posefield.encode.formats import POSE_ENCODERS, TableEncoder
from posefield.http import responses, worker_threads
from posefield.http.steps import Context, Steps, from_body, from_url
from posefield.question.motion_question import PoseQuestion
from posefield.question.results import PoseAnswer
from posefield.synthesis import poses
from posefield.synthesis.poses import PreparedPoseQuestion

Poses = Context[TableEncoder[PoseAnswer[Any]]]


@dataclass(frozen=True)
class PoseTask:
    """A validated question for poses.

    constraints: its constraints. apart: true if synthesis and encoding take a thread.
    """

    moments: PreparedPoseQuestion
    constraints: ConstraintSet
    apart: bool


async def validate(context: Poses, question: PoseQuestion) -> PoseTask:
    """Return the question with its controls, times and constraints checked."""
    model = context.model
    if question.targets:
        # Open controls are inferred from predictions of every captured clip, which takes time.
        asked = await worker_threads.run_in_thread(
            poses.prepare, model, question, places=worker_threads.POSE_LIMITER
        )
    else:
        asked = poses.prepare(model, question)
    goals = model.solver.constraints(asked.question, question)
    return PoseTask(asked, goals, bool(goals) or len(question.times) > context.form.inline_limit)


def places(context: Poses, task: PoseTask) -> AbstractAsyncContextManager[None]:
    """Return the limit on requests that take a thread."""
    return worker_threads.POSE_LIMITER if task.apart else nullcontext()


async def synthesise(context: Poses, task: PoseTask) -> PoseAnswer[Any]:
    """Return the poses: of the constraint solver, of the graph, or of a batch of requests."""
    model, moments = context.model, task.moments
    if task.constraints:
        return await worker_threads.within(
            poses.synthesize_constrained, model, moments, task.constraints
        )
    if task.apart:
        (row,) = await worker_threads.within(poses.run_batch, model, [moments])
    else:
        row = await context.service.pose_batcher.row(model, moments)
    return poses.build_answer(model, moments, row)


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
