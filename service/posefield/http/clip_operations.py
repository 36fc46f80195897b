"""Steps of requests for one clip, and for an archive of many."""

from collections.abc import Iterator, Mapping
from contextlib import AbstractAsyncContextManager, nullcontext
from dataclasses import dataclass
from functools import partial

from starlette.requests import Request
from starlette.responses import Response

from posefield.batch import clip_archive
from posefield.batch.clip_archive import Order
from posefield.encode.archives import PACKS, Pack
from posefield.encode.files.file_convention import Convention
from posefield.encode.formats import ENCODERS, Encoder, poses_within
from posefield.http import responses
from posefield.http.concurrency import worker_threads
from posefield.http.decoding import clips_query, request_body
from posefield.http.steps import Context, Steps, from_body, from_url, unlimited
from posefield.question.motion_question import FileQuestion
from posefield.question.results import ClipAnswer
from posefield.synthesis import clips
from posefield.synthesis.frame_times import MOST_POSES

Clips = Context[Encoder]
Packs = Context[Pack]


@dataclass(frozen=True)
class ClipTask:
    """A question for a clip within the limits.

    most: largest number of frames. convention: unit and up axis of the file. corrected: true if
    the constraint solver answers.
    """

    question: FileQuestion
    most: int
    convention: Convention
    corrected: bool


async def validate(context: Clips, question: FileQuestion) -> ClipTask:
    """Return the question with the limits that its format sets; synthesis checks the rest."""
    encoder, model = context.form, context.model
    convention = encoder.convention(question.unit, question.up)
    joints = len(model.session.card.skeleton)
    fits = poses_within(context.service.settings.output_limit, joints, encoder.per_joint)
    corrected = bool(model.keeper.measures or question.corrects)
    return ClipTask(question, min(fits, MOST_POSES), convention, corrected)


def places(context: Clips, task: ClipTask) -> AbstractAsyncContextManager[None]:
    """Return the limit on requests that the constraint solver answers."""
    return worker_threads.SOLVER if task.corrected else nullcontext()


async def synthesise(context: Clips, task: ClipTask) -> ClipAnswer:
    """Return the clip."""
    if task.corrected:
        # A correction takes milliseconds, which would block the event loop.
        return await worker_threads.within(clips.clip, context.model, task.question, task.most)
    return clips.clip(context.model, task.question, task.most)


async def encode(context: Clips, task: ClipTask, answer: ClipAnswer) -> bytes:
    """Return the clip as a file; long ones and those of templates in a thread."""
    encoder = context.form
    if len(answer.clip) <= encoder.at_once:
        return encoder.encode(answer, task.convention)
    return await context.service.desk.file(encoder, task.convention, answer)


def respond(context: Clips, answer: ClipAnswer, content: bytes) -> Response:
    """Return the response, with the facts of trust in its headers."""
    return responses.file(content, context.form, answer.trust)


# The default of Accept is binary USD.
_steps = partial(
    Steps[Encoder, FileQuestion, ClipTask, ClipAnswer, bytes],
    {"usdc": ENCODERS["usdc"], **ENCODERS},
    validate=validate,
    places=places,
    synthesise=synthesise,
    encode=encode,
    respond=respond,
)
GET_CLIP = _steps(decode=from_url(FileQuestion))
QUERY_CLIP = _steps(decode=from_body(FileQuestion))


async def read_clips(context: Packs, request: Request) -> bytes:
    """Return the body of a request for many clips."""
    service = context.service
    return await request_body.read(request, service.settings.clips_body_limit, service.bodies)


async def validate_clips(encoders: Mapping[str, Encoder], context: Packs, content: bytes) -> Order:
    """Return the order of a body, which later steps do not refuse."""
    return await worker_threads.run(
        clips_query.order,
        context.model,
        encoders,
        content,
        context.service.settings,
        places=worker_threads.CLIPS,
    )


async def synthesise_clips(context: Packs, order: Order) -> Iterator[tuple[str, bytes]]:
    """Return an iterator over the names and files of the clips, made as they are sent."""
    return clip_archive.members(order)


async def pack_clips(
    context: Packs, order: Order, members: Iterator[tuple[str, bytes]]
) -> tuple[Iterator[bytes], list[str]]:
    """Return the pieces of the archive, and its warnings."""
    return responses.gathered(context.form.write(members)), order.warnings


def send_clips(
    context: Packs, members: object, content: tuple[Iterator[bytes], list[str]]
) -> Response:
    """Return the response that streams the archive."""
    pieces, warnings = content
    sent = responses.sent(pieces, worker_threads.CLIPS)
    return responses.streamed(sent, context.form, context.model, warnings)


def query_clips(
    encoders: Mapping[str, Encoder],
) -> Steps[Pack, bytes, Order, Iterator[tuple[str, bytes]], tuple[Iterator[bytes], list[str]]]:
    """Return the steps of a request for many clips in the formats of these encoders."""
    return Steps(
        PACKS,
        read_clips,
        partial(validate_clips, encoders),
        unlimited,
        synthesise_clips,
        pack_clips,
        send_clips,
    )
