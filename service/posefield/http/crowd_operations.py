"""Steps of crowd requests: poses of many characters, and walking crowds."""

from collections.abc import Iterator
from contextlib import AbstractAsyncContextManager
from dataclasses import dataclass

from starlette.requests import Request
from starlette.responses import Response

from posefield.encode.formats import (
    CROWD_ENCODERS,
    CROWD_WRITERS,
    CrowdWriter,
    TableEncoder,
    max_poses,
)
from posefield.http import responses
from posefield.http.concurrency import worker_threads
from posefield.http.decoding import crowd_query, request_body
from posefield.http.steps import Context, Steps, from_url
from posefield.locomotion.crowd_order import CrowdOrder
from posefield.motion.crowd_clip import CrowdClip, CrowdPoses
from posefield.question.body_kind import DEFAULT_BODY, BodyKind
from posefield.question.walk_question import WalkQuestion
from posefield.synthesis import crowd_synthesis, walking_feet
from posefield.synthesis.synthesizer import Synthesizer

Crowds = Context[TableEncoder[CrowdPoses]]
Walks = Context[CrowdWriter]


def places(context: object, task: object) -> AbstractAsyncContextManager[None]:
    """Return the limit on crowds."""
    return worker_threads.CROWD_LIMITER


@dataclass(frozen=True)
class CrowdTask:
    """Body of a crowd request, decoded with its poses. most: largest number of characters."""

    content: bytes
    most: float


async def read_crowd(context: Crowds, request: Request) -> bytes:
    """Return the body, whose decoding takes a thread."""
    service = context.service
    return await request_body.read_body(request, service.settings.crowd_body_limit, service.bodies)


async def limit_crowd(context: Crowds, content: bytes) -> CrowdTask:
    """Return the body with the limits of the settings and the format."""
    settings, encoder = context.service.settings, context.form
    card = context.model.session.card
    sizes = len(card.skeleton), encoder.bytes_per_joint, len(card.curves)
    fits = max_poses(settings.output_limit, *sizes)
    return CrowdTask(content, min(settings.crowd_limit, encoder.most, fits))


async def pose_crowd(context: Crowds, task: CrowdTask) -> CrowdPoses:
    """Return the poses of a crowd."""
    return await worker_threads.within(_poses, context.model, task)


def _poses(model: Synthesizer, task: CrowdTask) -> CrowdPoses:
    return crowd_synthesis.synthesize_crowd(model, crowd_query.of_body(task.content, task.most))


async def encode_crowd(context: Crowds, task: CrowdTask, answer: CrowdPoses) -> bytes:
    """Return the poses as a file, large ones in a thread."""
    if len(answer.rotations) <= context.form.inline_limit:
        return context.form.encode(answer)
    return await worker_threads.within(context.form.encode, answer)


def send_crowd(context: Crowds, answer: CrowdPoses, content: bytes) -> Response:
    """Return the response."""
    return responses.attachment(content, context.form, context.model.name)


QUERY_CROWD = Steps(
    CROWD_ENCODERS, read_crowd, limit_crowd, places, pose_crowd, encode_crowd, send_crowd
)


@dataclass(frozen=True)
class WalkTask:
    """A walking crowd within the limits of the settings.

    instancing: how USD repeats characters. body: that they have.
    """

    order: CrowdOrder
    instancing: str
    body: BodyKind


async def limit_walk(context: Walks, question: WalkQuestion) -> WalkTask:
    """Return the order of a walking crowd; InvalidField beyond the limits."""
    card, settings = context.model.session.card, context.service.settings
    order = crowd_query.checked_order(question, context.form.extension, card, settings)
    return WalkTask(order, question.instancing, question.body or DEFAULT_BODY)


async def plan_walk(context: Walks, task: WalkTask) -> CrowdClip:
    """Return the crowd with planned paths, whose motions are computed as they are sent."""
    return await worker_threads.within(_planned, context.model, task)


def _planned(model: Synthesizer, task: WalkTask) -> CrowdClip:
    return walking_feet.build_crowd(model, model.gait, task.order)


async def encode_walk(context: Walks, task: WalkTask, answer: CrowdClip) -> Iterator[bytes]:
    """Return an iterator over the pieces of the file."""
    return await worker_threads.within(context.form.stream, answer, task.instancing, task.body)


def send_walk(context: Walks, answer: CrowdClip, content: Iterator[bytes]) -> Response:
    """Return the response that streams the crowd."""
    share, said = float(answer.facts["outside_share"]), list(answer.facts.get("warnings", ()))
    if share:
        outside = f"{100 * share:.1f} % of the poses have some control outside what was sampled"
        said.insert(0, outside)
    sent = responses.sent(content, worker_threads.CROWD_LIMITER)
    return responses.stream(sent, context.form, context.model, said)


# The default of Accept is binary USD.
GET_CROWD = Steps(
    {"usdc": CROWD_WRITERS["usdc"], **CROWD_WRITERS},
    from_url(WalkQuestion),
    limit_walk,
    places,
    plan_walk,
    encode_walk,
    send_walk,
)
