"""Questions for many clips as they travel: a JSON body to clips that have passed the door."""

from collections.abc import Mapping, Sequence
from typing import Annotated

import msgspec

from service.encode import Encoder
from service.encode.convention import Unit, Up
from service.export import names
from service.export.cells import LEGAL_NAME
from service.export.pack import Order
from service.export.query import Query
from service.motion.errors import InvalidField, QueryError
from service.synthesis import clips
from service.synthesis.question import Prospect
from service.synthesis.synthesizer import Synthesizer
from service.web import decoding, problems, query
from service.web.problems import pointer
from service.web.query import ClipBody
from service.web.settings import Settings

Name = Annotated[str, msgspec.Meta(pattern=rf"^{LEGAL_NAME.pattern}\Z")]
OWN_NAME = "expected a name of its own: an earlier clip has it, capitals count for nothing"


class NamedClipBody(ClipBody, frozen=True):
    """Schema NamedClipQuestion of the contract."""

    name: Name | None = None


class ClipsBody(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Schema ClipsQuestion of the contract."""

    format: str
    clips: list[NamedClipBody]
    unit: Unit | None = None
    up: Up | None = None


_CLIPS = msgspec.json.Decoder(ClipsBody)


def order(
    model: Synthesizer, encoders: Mapping[str, Encoder], content: bytes, settings: Settings
) -> Order:
    """What a JSON body asks of a model, checked so far that nothing of it can be refused later.

    RequestFault where it breaks the contract's form or one clip has no answer, InvalidField where
    it asks for too much.
    """
    body = decoding.decoded(_CLIPS, content)
    if body.format not in encoders:
        detail = f"{body.format!r}, expected one of {', '.join(encoders)}"
        raise decoding.bad_body(detail, pointer("format"))
    if not 1 <= len(body.clips) <= settings.clips_limit:
        expected = f"expected 1 to {settings.clips_limit}"
        raise InvalidField("clips", f"{len(body.clips)} clips, {expected}")
    encoder = encoders[body.format]
    convention = encoder.convention(body.unit, body.up)
    queries = [_query(index, clip, body.format) for index, clip in enumerate(body.clips)]
    _check_names(queries)
    prospects = _prospects(model, queries, settings.clips_poses)
    return Order(model, encoder, convention, queries, prospects)


def _query(index: int, body: NamedClipBody, extension: str) -> Query:
    within = "clips", str(index)
    name = names.generated(index) if body.name is None else body.name
    return Query(name, extension, query.clip_of(body, *within), pointer(*within))


def _check_names(queries: Sequence[Query]) -> None:
    called = [each.name for each in queries]
    for index in names.Seen().repeated(called):
        error = InvalidField("name", f"{called[index]!r}, {OWN_NAME}")
        raise problems.within(error, queries[index].place)


def _prospects(model: Synthesizer, queries: Sequence[Query], most: int) -> list[Prospect]:
    found, poses = [], 0
    for each in queries:
        try:
            found.append(clips.prospect(model, each.question))
        except QueryError as error:
            raise problems.within(error, each.place) from None
        poses += found[-1].frames
    if poses > most:
        raise InvalidField("clips", f"{poses} frames in all, expected at most {most}")
    return found
