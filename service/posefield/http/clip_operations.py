"""Steps of requests for one clip, and for an archive of many."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractAsyncContextManager, nullcontext
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

from starlette.requests import Request
from starlette.responses import Response

from posefield.batch import clip_archive, rows
from posefield.batch.clip_archive import ArchiveOrder
from posefield.batch.rows import ClipQuery
from posefield.characters import delivery
from posefield.characters.delivery import Delivery
from posefield.characters.user_character import EMPTY, CharacterFolder
from posefield.common import cancellation
from posefield.common.errors import FormError, InvalidField, QueryError, did_you_mean
from posefield.constraints import targets
from posefield.encode.archives import ARCHIVE_WRITERS, ArchiveWriter
from posefield.encode.conventions import Convention
from posefield.encode.formats import CLIP_ENCODERS, ClipEncoder, max_poses
from posefield.http import responses, steps, worker_threads
from posefield.http.api import problems
from posefield.http.api.settings import Settings
from posefield.http.steps import Context, Steps, from_body, from_url, unlimited
from posefield.question import json_decoding as bodies
from posefield.question.json_decoding import json_pointer
from posefield.question.motion_question import ClipsQuestion, FileQuestion, NamedClipQuestion
from posefield.question.results import ClipAnswer
from posefield.synthesis import clip_batch, clips
from posefield.synthesis.clips import ClipPreview
from posefield.synthesis.poses import MAX_POSES
from posefield.synthesis.synthesizer import Synthesizer

REPEATED_NAME = "expected a name of its own: an earlier clip has it, capitals count for nothing"


def decode_order(
    model: Synthesizer,
    encoders: Mapping[str, ClipEncoder],
    content: bytes,
    settings: Settings,
    characters: CharacterFolder = EMPTY,
) -> ArchiveOrder:
    """Return the validated order of a JSON body, which later steps do not refuse.

    Raises FormError for a malformed body, RequestError for an invalid clip and InvalidField for a
    request beyond the limits.
    """
    body = bodies.decode_question(ClipsQuestion, content)
    if body.format not in encoders:
        hint = did_you_mean(body.format, encoders)
        detail = f"{body.format!r}{hint}, expected one of {', '.join(encoders)}"
        raise FormError("format", detail)
    if not 1 <= len(body.clips) <= settings.clips_limit:
        expected = f"expected 1 to {settings.clips_limit}"
        raise InvalidField("clips", f"{len(body.clips)} clips, {expected}")
    encoder = encoders[body.format]
    order = _archive_delivery(characters, encoder, body)
    if order is None:
        convention = encoder.convention(body.unit, body.up, body.body)
    else:
        convention = order.convention
    queries = [_clip_query(index, clip, body.format) for index, clip in enumerate(body.clips)]
    _check_names(queries)
    _check_targets(model, queries, settings.clips_targets)
    card = model.session.card
    joints = len(card.skeleton)
    if order is not None:
        _check_delivery(model, queries, order)
        joints = max(joints, order.joints)
    sizes = joints, encoder, len(card.curves)
    within = max_poses(settings.output_limit, *sizes)
    prospects = _check_prospects(model, queries, min(within, MAX_POSES), settings.clips_poses)
    return ArchiveOrder(model, encoder, convention, queries, prospects, order)


def _archive_delivery(
    characters: CharacterFolder, encoder: ClipEncoder, body: ClipsQuestion
) -> Delivery | None:
    """Return the delivery to a character of a user; None for the character of the model."""
    if body.character is None:
        return None
    return delivery.deliver(characters.find(body.character), encoder, body)


def _check_delivery(model: Synthesizer, queries: Sequence[ClipQuery], order: Delivery) -> None:
    card = model.session.card
    for each in queries:
        try:
            order.check(each.question, card.skeleton, card.roles)
        except QueryError as error:
            raise problems.nested_error(error, each.place) from None


def _clip_query(index: int, asked: NamedClipQuestion, extension: str) -> ClipQuery:
    cancellation.check()
    name = rows.generated_name(index) if asked.name is None else asked.name
    return ClipQuery(name, extension, asked, json_pointer("clips", str(index)))


def _check_names(queries: Sequence[ClipQuery]) -> None:
    called = [each.name for each in queries]
    for index in rows.repeated_names(called):
        error = InvalidField("name", f"{called[index]!r}, {REPEATED_NAME}")
        raise problems.nested_error(error, queries[index].place)


def _check_targets(model: Synthesizer, queries: Sequence[ClipQuery], most: int) -> None:
    cost = sum(targets.solver_cost(model.session.card, each.question) for each in queries)
    if cost > most:
        raise InvalidField(
            "clips",
            f"targets of all clips cost {cost}, expected at most {most}; a target counts as one, "
            f"as {targets.OPEN_COST} where controls are left open",
        )


def _check_prospects(
    model: Synthesizer, queries: Sequence[ClipQuery], longest: int, most: int
) -> list[ClipPreview]:
    """Return the prospect of each clip.

    longest: maximum frames of one clip. most: maximum frames of all clips.
    """
    found, poses = [], 0
    for each in queries:
        cancellation.check()
        try:
            found.append(clips.preview_clip(model, each.question, longest))
        except QueryError as error:
            raise problems.nested_error(error, each.place) from None
        poses += found[-1].frames
    if poses > most:
        raise InvalidField("clips", f"{poses} frames in all, expected at most {most}")
    return found


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
    sizes = joints, encoder, len(card.curves)
    fits = max_poses(context.service.settings.output_limit, *sizes)
    corrected = not clip_batch.is_predicted(model, question)
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
    return worker_threads.SYNTHESIS_LIMITER if long else nullcontext()


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
    return await steps.read_body(request, service.settings.clips_body_limit, service.bodies)


async def validate_clips(
    encoders: Mapping[str, ClipEncoder], context: Packs, content: bytes
) -> ArchiveOrder:
    """Return the order of a body, which later steps do not refuse."""
    return await worker_threads.run_in_thread(
        decode_order,
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
