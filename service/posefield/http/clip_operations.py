"""Steps of requests for one clip, and for an archive of many."""

from collections.abc import Iterator, Mapping
from contextlib import AbstractAsyncContextManager, nullcontext
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

from starlette.requests import Request
from starlette.responses import Response

from posefield.batch import clip_archive
from posefield.batch.clip_archive import ArchiveOrder
from posefield.characters import delivery
from posefield.characters.delivery import Delivery
from posefield.encode.archives import ARCHIVE_WRITERS, ArchiveWriter
from posefield.encode.files.file_convention import Convention
from posefield.encode.formats import CLIP_ENCODERS, ClipEncoder, max_poses
from posefield.http import responses
from posefield.http.concurrency import worker_threads
from posefield.http.decoding import clips_query, request_body
from posefield.http.steps import Context, Steps, from_body, from_url, unlimited
from posefield.question.motion_question import FileQuestion
from posefield.question.results import ClipAnswer
from posefield.synthesis import clip_drafts, clips
from posefield.synthesis.frame_times import MAX_POSES

Clips = Context[ClipEncoder]
Packs = Context[ArchiveWriter]


@dataclass(frozen=True)
class ClipTask:
    """A question for a clip within the limits.

    most: largest number of frames. convention: unit and up axis of the file. corrected: true if
    the constraint solver answers or feet are placed. delivery: to a character of a user.
    """

    question: FileQuestion
    most: int
    convention: Convention
    corrected: bool
    delivery: Delivery | None = None


class SynthesisedClip(NamedTuple):
    """A clip, and its file if that was made in the same batch."""

    answer: ClipAnswer
    content: bytes | None = None


async def validate(context: Clips, question: FileQuestion) -> ClipTask:
    """Return the question with the limits that its format sets; synthesis checks the rest."""
    encoder, model = context.form, context.model
    card = model.session.card
    joints, delivery = len(card.skeleton), _delivery(context, question)
    if delivery is None:
        convention = encoder.convention(question.unit, question.up, question.body)
    else:
        convention, joints = delivery.convention, max(joints, delivery.joints)
    sizes = joints, encoder.bytes_per_joint, len(card.curves)
    fits = max_poses(context.service.settings.output_limit, *sizes)
    corrected = not clip_drafts.is_predicted(model, question)
    return ClipTask(question, min(fits, MAX_POSES), convention, corrected, delivery)


def _delivery(context: Clips, question: FileQuestion) -> Delivery | None:
    """Return the delivery to a character of a user; None for the character of the model."""
    if question.character is None:
        return None
    character, card = (
        context.service.characters.find(question.character),
        context.model.session.card,
    )
    found = delivery.deliver(character, context.form, question)
    found.check(question, card.skeleton, card.roles)
    return found


def places(context: Clips, task: ClipTask) -> AbstractAsyncContextManager[None]:
    """Return the limit on requests that the constraint solver answers."""
    long = task.corrected or task.delivery is not None
    return worker_threads.SOLVER_LIMITER if long else nullcontext()


async def synthesise(context: Clips, task: ClipTask) -> SynthesisedClip:
    """Return the clip, with its file where several requests share the work on both."""
    encoder, model, question = context.form, context.model, task.question
    if task.delivery is not None:
        return SynthesisedClip(
            await worker_threads.within(_delivered, context, task, task.delivery)
        )
    if task.corrected:
        # A correction takes milliseconds, which would block the event loop.
        answer = await worker_threads.within(clips.synthesize_clip, model, question, task.most)
        return SynthesisedClip(answer)
    if not encoder.inline_limit:
        batcher = context.service.clip_batcher
        return SynthesisedClip(
            *await batcher.clip(model, question, task.most, encoder, task.convention)
        )
    return SynthesisedClip(clips.synthesize_clip(model, question, task.most))


def _delivered(context: Clips, task: ClipTask, order: Delivery) -> ClipAnswer:
    answer = clips.synthesize_clip(context.model, task.question, task.most)
    return order.clip(answer, task.question, context.model.session.card.roles)


async def encode(context: Clips, task: ClipTask, made: SynthesisedClip) -> bytes:
    """Return the clip as a file; long ones and those of templates in a thread."""
    encoder, answer = context.form, made.answer
    if made.content is not None:
        return made.content
    if task.delivery is not None:
        return await worker_threads.within(task.delivery.encode, answer)
    if len(answer.clip) <= encoder.inline_limit:
        return encoder.encode(answer, task.convention)
    return await context.service.clip_batcher.file(encoder, task.convention, answer)


def respond(context: Clips, made: SynthesisedClip, content: bytes) -> Response:
    """Return the response, with the facts of trust in its headers."""
    return responses.clip_file(content, context.form, context.form.noted(made.answer).trust)


# The default of Accept is binary USD.
_steps = partial(
    Steps[ClipEncoder, FileQuestion, ClipTask, SynthesisedClip, bytes],
    {"usdc": CLIP_ENCODERS["usdc"], **CLIP_ENCODERS},
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
    return await request_body.read_body(request, service.settings.clips_body_limit, service.bodies)


async def validate_clips(
    encoders: Mapping[str, ClipEncoder], context: Packs, content: bytes
) -> ArchiveOrder:
    """Return the order of a body, which later steps do not refuse."""
    return await worker_threads.run_in_thread(
        clips_query.decode_order,
        context.model,
        encoders,
        content,
        context.service.settings,
        context.service.characters,
        places=worker_threads.ARCHIVE_LIMITER,
    )


async def synthesise_clips(context: Packs, order: ArchiveOrder) -> Iterator[tuple[str, bytes]]:
    """Return an iterator over the names and files of the clips, made as they are sent."""
    return clip_archive.archive_members(order)


async def pack_clips(
    context: Packs, order: ArchiveOrder, members: Iterator[tuple[str, bytes]]
) -> tuple[Iterator[bytes], list[str]]:
    """Return the pieces of the archive, and its warnings."""
    return responses.merged_chunks(context.form.write(members)), order.warnings


def send_clips(
    context: Packs, members: object, content: tuple[Iterator[bytes], list[str]]
) -> Response:
    """Return the response that streams the archive."""
    pieces, warnings = content
    sent = responses.sent(pieces, worker_threads.ARCHIVE_LIMITER)
    return responses.stream(sent, context.form, context.model, warnings)


def query_clips(
    encoders: Mapping[str, ClipEncoder],
) -> Steps[
    ArchiveWriter,
    bytes,
    ArchiveOrder,
    Iterator[tuple[str, bytes]],
    tuple[Iterator[bytes], list[str]],
]:
    """Return the steps of a request for many clips in the formats of these encoders."""
    return Steps(
        ARCHIVE_WRITERS,
        read_clips,
        partial(validate_clips, encoders),
        unlimited,
        synthesise_clips,
        pack_clips,
        send_clips,
    )
