"""Operations that answer with an archive of many motions, made as they are sent.

Each file of an archive is checked before the first is made, so that a request is refused as a
whole.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from starlette.responses import Response

from posefield.batch import rows
from posefield.batch.clip_files import ArchiveOrder, ClipFormat
from posefield.batch.job import archive_members
from posefield.batch.rows import Row
from posefield.batch.scripts import ArchivedScript, PerformanceFormat, PerformanceOrder
from posefield.characters import delivery
from posefield.characters.user_character import EMPTY, CharacterFolder
from posefield.common import cancellation
from posefield.common.errors import FormError, InvalidField, QueryError, did_you_mean
from posefield.constraints import targets
from posefield.encode import formats
from posefield.encode.archives import ARCHIVE_WRITERS
from posefield.encode.formats import CLIP_ENCODERS, ClipEncoder, max_poses
from posefield.http import responses
from posefield.http.api import problems
from posefield.http.api.settings import Settings
from posefield.http.batching import ARCHIVE_LIMITER, LONG_LIMITER, run_in_thread
from posefield.http.request import ServiceRequest, read_body
from posefield.performance import composition
from posefield.performance.script import resolve_script
from posefield.question import json_decoding
from posefield.question.json_decoding import json_pointer
from posefield.question.motion_question import ClipsQuestion, NamedClipQuestion
from posefield.question.performance_question import NamedScript, PerformancesQuestion
from posefield.registry.model_registry import ModelRegistry
from posefield.synthesis import clips
from posefield.synthesis.clips import ClipPreview
from posefield.synthesis.poses import MAX_POSES
from posefield.synthesis.synthesizer import Synthesizer

REPEATED_NAME = "{!r}, expected a name of its own: an earlier {} has it, capitals count for nothing"


async def answer_clips(request: ServiceRequest) -> Response:
    """Answer with an archive of clips."""
    service, settings, model = request.service, request.service.settings, request.model
    content = await read_body(request, settings.clips_body_limit, service.bodies)
    order = await run_in_thread(
        clip_order, model, content, settings, service.characters, limiter=ARCHIVE_LIMITER
    )
    archive = ARCHIVE_WRITERS[request.format]
    pieces = archive.write(archive_members(order.files()))
    warnings, identity = order.warnings, model.identity
    return responses.stream(pieces, archive, model.name, warnings, ARCHIVE_LIMITER, identity)


async def answer_performances(request: ServiceRequest) -> Response:
    """Answer with an archive of performances."""
    service, settings = request.service, request.service.settings
    content = await read_body(request, settings.clips_body_limit, service.bodies)
    order = await run_in_thread(
        script_order,
        request.library,
        content,
        settings,
        service.characters,
        limiter=ARCHIVE_LIMITER,
    )
    archive = ARCHIVE_WRITERS[request.format]
    pieces = archive.write(archive_members(order.files()))
    return responses.stream(pieces, archive, "performances", order.warnings, LONG_LIMITER)


def clip_order(
    model: Synthesizer, content: bytes, settings: Settings, characters: CharacterFolder = EMPTY
) -> ArchiveOrder:
    """Return the validated order of a JSON body, which later steps do not refuse.

    Raises FormError for a malformed body, RequestError for an invalid clip and InvalidField for a
    request beyond the limits.
    """
    body = json_decoding.decode_question(ClipsQuestion, content)
    encoder = _encoder(body.format)
    _check_count("clips", len(body.clips), settings.clips_limit)
    order = None
    if body.character is None:
        convention = encoder.convention(body.unit, body.up, body.body)
        encoder.check_body(model.session.card.skeleton, model.session.card.roles)
    else:
        order = delivery.deliver(characters.find(body.character), encoder, body)
        convention = order.convention
    names = [
        rows.generated_name(index) if clip.name is None else clip.name
        for index, clip in enumerate(body.clips)
    ]
    _check_names("clip", names)
    cost = sum(targets.solver_cost(model.session.card, clip) for clip in body.clips)
    if cost > settings.clips_targets:
        raise InvalidField(
            "clips",
            f"targets of all clips cost {cost}, expected at most {settings.clips_targets}; a "
            f"target counts as one, as {targets.OPEN_COST} where controls are left open",
        )
    queries = [
        Row(name, body.format, clip, json_pointer("clips", str(index)))
        for index, (name, clip) in enumerate(zip(names, body.clips, strict=True))
    ]
    card = model.session.card
    joints = len(card.skeleton)
    if order is not None:
        for index, clip in enumerate(body.clips):
            with _element("clips", index):
                order.check(clip, card.skeleton, card.roles)
        joints = max(joints, order.joints)
    longest = min(max_poses(settings.output_limit, joints, encoder, len(card.curves)), MAX_POSES)
    previews = _previews(model, queries, longest, settings.clips_poses)
    return ArchiveOrder(model, ClipFormat(encoder, convention, order), queries, previews)


def _previews(
    model: Synthesizer, queries: Sequence[Row[NamedClipQuestion]], longest: int, limit: int
) -> list[ClipPreview]:
    """Return the preview of each clip.

    longest: largest number of frames of one clip. limit: that of all clips.
    """
    previews, frames = [], 0
    for index, query in enumerate(queries):
        cancellation.check()
        with _element("clips", index):
            previews.append(clips.preview_clip(model, query.question, longest))
        frames += previews[-1].frames
    if frames > limit:
        raise InvalidField("clips", f"{frames} frames in all, expected at most {limit}")
    return previews


def script_order(
    library: ModelRegistry, content: bytes, settings: Settings, characters: CharacterFolder = EMPTY
) -> PerformanceOrder:
    """Return the planned order of a JSON body, which later steps do not refuse.

    Raises FormError for a malformed body, RequestError for an invalid script and InvalidField for a
    request beyond the limits.
    """
    body = json_decoding.decode_question(PerformancesQuestion, content)
    encoder = _encoder(body.format)
    formats.performance_encoder(encoder, body.layout)
    _check_count("scripts", len(body.scripts), settings.performances_limit)
    segments = sum(len(script.segments) for script in body.scripts)
    if segments > settings.performances_segments:
        expected = f"expected at most {settings.performances_segments}"
        raise InvalidField("scripts", f"{segments} segments in all, {expected}")
    names = [
        f"performance-{index:06d}" if script.name is None else script.name
        for index, script in enumerate(body.scripts)
    ]
    _check_names("script", names)
    if body.character is None:
        planned = tuple(_planned(library, encoder, names, body.scripts, settings, 0))
        return PerformanceOrder(planned, PerformanceFormat(encoder, body.layout))
    character = characters.find(body.character)
    for index, script in enumerate(body.scripts):
        with _element("scripts", index, "character"):
            order = delivery.deliver(character, encoder, script)
            character.check(script)
        order.check_layout(body.layout)
    joints = len(character.rig.skeleton)
    planned = tuple(_planned(library, encoder, names, body.scripts, settings, joints))
    order = delivery.deliver(character, encoder, body.scripts[0])
    for index, entry in enumerate(planned):
        with _element("scripts", index):
            body_of_script = entry.script.character
            order.check(entry.script.question, body_of_script.skeleton, body_of_script.roles)
    return PerformanceOrder(planned, PerformanceFormat(encoder, body.layout, character))


def _planned(
    library: ModelRegistry,
    encoder: ClipEncoder,
    names: Sequence[str],
    questions: Sequence[NamedScript],
    settings: Settings,
    joints: int,
) -> Iterator[ArchivedScript]:
    """Yield the planned scripts; InvalidField as soon as they are too long together.

    joints: of the character of a user; 0 without one.
    """
    seconds, limit = 0.0, settings.performances_seconds
    for index, (name, question) in enumerate(zip(names, questions, strict=True)):
        cancellation.check()
        with _element("scripts", index, "format"):
            encoder.convention(question.unit, question.up, question.body)
            script = resolve_script(question, library.find)
            encoder.check_body(script.character.skeleton, script.character.roles)
            largest = max(len(script.character.skeleton), joints)
            longest = max_poses(settings.output_limit, largest, encoder)
            report = composition.plan(script, longest)
        seconds += report.duration
        if seconds > limit:
            detail = f"{seconds:.0f} s with script {index}, expected at most {limit} s in all"
            raise InvalidField("scripts", detail)
        yield ArchivedScript(name, script, longest, bool(report.warnings))


def _encoder(extension: str) -> ClipEncoder:
    if extension not in CLIP_ENCODERS:
        hint = did_you_mean(extension, CLIP_ENCODERS)
        detail = f"{extension!r}{hint}, expected one of {', '.join(CLIP_ENCODERS)}"
        raise FormError("format", detail)
    return CLIP_ENCODERS[extension]


def _check_count(field: str, count: int, limit: int) -> None:
    if not 1 <= count <= limit:
        raise InvalidField(field, f"{count} {field}, expected 1 to {limit}")


def _check_names(kind: str, names: Sequence[str]) -> None:
    """Raise RequestError for a repeated name; kind: of the motions, "clip" or "script"."""
    for index in rows.repeated_names(names):
        with _element(f"{kind}s", index):
            raise InvalidField("name", REPEATED_NAME.format(names[index], kind))


@contextmanager
def _element(field: str, index: int, shared: str | None = None) -> Iterator[None]:
    """Raise errors about an element of a list with its place in the body.

    shared: field of the body; errors about it stay as they are.
    """
    try:
        yield
    except QueryError as error:
        if error.field == shared:
            raise
        raise problems.nested_error(error, json_pointer(field, str(index))) from None
