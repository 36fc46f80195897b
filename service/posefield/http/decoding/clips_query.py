"""Requests for many clips: decoding and validation of the JSON body."""

from collections.abc import Mapping, Sequence

from posefield.batch import rows
from posefield.batch.clip_archive import ArchiveOrder
from posefield.batch.rows import ClipQuery
from posefield.characters import delivery
from posefield.characters.delivery import Delivery
from posefield.characters.user_character import EMPTY, CharacterFolder
from posefield.common import cancellation
from posefield.common.errors import FormError, InvalidField, QueryError
from posefield.common.name_suggestion import did_you_mean
from posefield.constraints import targets
from posefield.encode.formats import ClipEncoder, max_poses
from posefield.http.api import problems
from posefield.http.api.settings import Settings
from posefield.question import json_decoding as bodies
from posefield.question.json_decoding import json_pointer
from posefield.question.motion_question import ClipsQuestion, NamedClipQuestion
from posefield.synthesis import clips
from posefield.synthesis.clips import ClipPreview
from posefield.synthesis.frame_times import MAX_POSES
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
    order = _delivery(characters, encoder, body)
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
    sizes = joints, encoder.bytes_per_joint, len(card.curves)
    within = max_poses(settings.output_limit, *sizes)
    prospects = _check_prospects(model, queries, min(within, MAX_POSES), settings.clips_poses)
    return ArchiveOrder(model, encoder, convention, queries, prospects, order)


def _delivery(
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
