"""Requests for many performances: decoding and validation of the JSON body."""

from collections.abc import Iterator, Sequence

from posefield.batch import rows
from posefield.batch.scripts import ArchivedScript, PerformanceOrder
from posefield.characters import delivery
from posefield.characters.delivery import Delivery
from posefield.characters.user_character import EMPTY, CharacterFolder, UserCharacter
from posefield.common import cancellation
from posefield.common.errors import FormError, InvalidField, QueryError
from posefield.common.name_suggestion import did_you_mean
from posefield.encode import performance_files
from posefield.encode.formats import CLIP_ENCODERS, ClipEncoder, max_poses
from posefield.http.api import problems
from posefield.http.api.settings import Settings
from posefield.performance import composition
from posefield.performance.script import resolve_script
from posefield.question import json_decoding
from posefield.question.json_decoding import json_pointer
from posefield.question.performance_batch_question import NamedScript, PerformancesQuestion
from posefield.registry.model_registry import ModelRegistry

REPEATED_NAME = "expected a name of its own: an earlier script has it, capitals count for nothing"


def decode_order(
    library: ModelRegistry,
    content: bytes,
    settings: Settings,
    characters: CharacterFolder = EMPTY,
) -> PerformanceOrder:
    """Return the planned order of a JSON body, which later steps do not refuse.

    Raises FormError for a malformed body, RequestError for an invalid script and InvalidField for a
    request beyond the limits.
    """
    body = json_decoding.decode_question(PerformancesQuestion, content)
    if body.format not in CLIP_ENCODERS:
        hint = did_you_mean(body.format, CLIP_ENCODERS)
        detail = f"{body.format!r}{hint}, expected one of {', '.join(CLIP_ENCODERS)}"
        raise FormError("format", detail)
    encoder = CLIP_ENCODERS[body.format]
    encode = performance_files.encoder(encoder, body.layout)
    _check_counts(body.scripts, settings)
    names = _names(body.scripts)
    character = None if body.character is None else characters.find(body.character)
    if character is not None:
        _check_character(body, encoder, character)
    scripts = zip(names, body.scripts, strict=True)
    own_joints = 0 if character is None else len(character.rig.skeleton)
    planned = tuple(_planned(library, encoder, scripts, settings, own_joints))
    if character is None:
        return PerformanceOrder(planned, encode)
    return PerformanceOrder(planned, encode, _delivery(planned, encoder, character))


def _check_character(
    body: PerformancesQuestion, encoder: ClipEncoder, character: UserCharacter
) -> None:
    """Raise InvalidField, or RequestError for one script, for what a character's files lack."""
    for index, script in enumerate(body.scripts):
        try:
            order = delivery.deliver(character, encoder, script)
            character.target.check(script)
        except InvalidField as error:
            if error.field == "character":
                raise
            raise problems.nested_error(error, json_pointer("scripts", str(index))) from None
        order.check_layout(body.layout)


def _delivery(
    planned: Sequence[ArchivedScript], encoder: ClipEncoder, character: UserCharacter
) -> Delivery:
    """Return the delivery of planned scripts, whose characters are checked."""
    found = delivery.deliver(character, encoder, planned[0].script.question)
    for index, own in enumerate(planned):
        try:
            found.check(
                own.script.question, own.script.character.skeleton, own.script.character.roles
            )
        except InvalidField as error:
            raise problems.nested_error(error, json_pointer("scripts", str(index))) from None
    return found


def _check_counts(scripts: Sequence[NamedScript], settings: Settings) -> None:
    if not 1 <= len(scripts) <= settings.performances_limit:
        expected = f"expected 1 to {settings.performances_limit}"
        raise InvalidField("scripts", f"{len(scripts)} scripts, {expected}")
    segments = sum(len(script.segments) for script in scripts)
    if segments > settings.performances_segments:
        expected = f"expected at most {settings.performances_segments}"
        raise InvalidField("scripts", f"{segments} segments in all, {expected}")


def _names(scripts: Sequence[NamedScript]) -> list[str]:
    """Return the names of the files without extension; RequestError for a repeated one."""
    names = [
        f"performance-{index:06d}" if script.name is None else script.name
        for index, script in enumerate(scripts)
    ]
    for index in rows.repeated_names(names):
        error = InvalidField("name", f"{names[index]!r}, {REPEATED_NAME}")
        raise problems.nested_error(error, json_pointer("scripts", str(index)))
    return names


def _planned(
    library: ModelRegistry,
    encoder: ClipEncoder,
    scripts: Iterator[tuple[str, NamedScript]],
    settings: Settings,
    own_joints: int,
) -> Iterator[ArchivedScript]:
    """Yield the planned scripts; InvalidField as soon as they are too long together.

    own_joints: of the character of a user; 0 without one.
    """
    seconds = 0.0
    for index, (name, question) in enumerate(scripts):
        cancellation.check()
        try:
            convention = encoder.convention(question.unit, question.up, question.body)
            script = resolve_script(question, library.find)
            joints = max(len(script.character.skeleton), own_joints)
            most = max_poses(settings.output_limit, joints, encoder.bytes_per_joint)
            report = composition.plan(script, most)
        except QueryError as error:
            raise problems.nested_error(error, json_pointer("scripts", str(index))) from None
        seconds += report.duration
        if seconds > settings.performances_seconds:
            found = f"{seconds:.0f} s with script {index}"
            expected = f"expected at most {settings.performances_seconds} s in all"
            raise InvalidField("scripts", f"{found}, {expected}")
        file = f"{name}.{encoder.extension}"
        yield ArchivedScript(name, file, script, convention, most, bool(report.warnings))
