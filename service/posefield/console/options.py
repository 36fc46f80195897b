"""Arguments and options that commands share, and those from the fields of a command's question."""

import functools
import inspect
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import MISSING, dataclass, fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_origin, get_type_hints

import typer
from msgspec import Struct

from posefield.common.errors import InvalidField, ModelError
from posefield.encode.formats import ClipEncoder
from posefield.encode.formats import encoder_for as encoder_for
from posefield.question import text_decoding
from posefield.question.motion_question import FileQuestion
from posefield.question.performance_question import PerformanceQuestion
from posefield.question.text_decoding import CONTROLS_FIELD, LABELS_FIELD, Parameter
from posefield.registry import model_registry
from posefield.synthesis.synthesizer import Synthesizer

if TYPE_CHECKING:
    from posefield.characters.delivery import Delivery
    from posefield.characters.user_character import UserCharacter


ModelPath = Annotated[
    Path,
    typer.Argument(
        help="model file, or name of a shipped model",
        metavar="MODEL",
        callback=model_registry.file_or_shipped,
    ),
]
Json = Annotated[bool, typer.Option("--json", help="print the result as JSON on standard output")]


def open_model(path: Path) -> Synthesizer:
    """Return the model of a file; ModelError for a folder."""
    if path.is_dir():
        raise ModelError(path, "a folder, expected one .onnx file")
    return next(iter(model_registry.load([path]).models.values()))


Command = Callable[..., None]
Controls = Annotated[
    list[str] | None,
    typer.Option(
        "--control",
        "-c",
        help="value of a control; may be repeated; omitted controls are inferred",
        metavar="NAME=VALUE",
    ),
]
CONTROL_OPTION = inspect.Parameter(
    "control", inspect.Parameter.KEYWORD_ONLY, default=None, annotation=Controls
)
TYPED_FIELDS = (float, int, bool)
"""Types that typer parses itself, in addition to literals."""


def with_question_options(
    form: type[Struct],
    default_values: Mapping[str, Any] | None = None,
    without: Collection[str] = (),
) -> Callable[[Command], Command]:
    """Return a decorator that builds the parameter `question` of a command from its options.

    default_values: of fields that differ from the form's. without: fields without an option.
    """
    shown_parameters = [
        p for p in text_decoding.parameters(form).values() if p.field not in without
    ]
    defaults = {p.field: p.default for p in shown_parameters} | dict(default_values or {})

    def decorate(command: Command) -> Command:
        signature = inspect.signature(command, eval_str=True).parameters.values()
        first = [p for p in signature if p.name != "question" and p.default is p.empty]
        last = [p for p in signature if p.default is not p.empty]
        options = [_option(p, defaults[p.field]) for p in shown_parameters]
        if CONTROLS_FIELD in form.__struct_fields__ and CONTROLS_FIELD not in without:
            options.insert(0, CONTROL_OPTION)

        @functools.wraps(command)
        def run(**values: Any) -> None:
            question_fields = {
                p.field: _value(p, values.pop(p.field), defaults[p.field]) for p in shown_parameters
            }
            if CONTROLS_FIELD in form.__struct_fields__:
                question_fields[CONTROLS_FIELD] = parse_controls(values.pop("control", None) or [])
            command(question=form(**question_fields), **values)

        arguments = [p.replace(kind=p.KEYWORD_ONLY) for p in (*first, *options, *last)]
        run.__signature__ = inspect.Signature(arguments)  # type: ignore[attr-defined]
        run.__annotations__ = {p.name: p.annotation for p in arguments}
        return run

    return decorate


def with_option_groups(command: Command) -> Command:
    """Return the command with an option for each field of its parameters that are dataclasses.

    The fields have typer's annotations, as parameters would.
    """
    signature = inspect.signature(command, eval_str=True).parameters.values()
    groups: dict[str, Any] = {p.name: p.annotation for p in signature if is_dataclass(p.annotation)}

    @functools.wraps(command)
    def run(**values: Any) -> None:
        for name, group in groups.items():
            values[name] = group(**{f.name: values.pop(f.name) for f in fields(group)})
        command(**values)

    arguments = [
        q for p in signature for q in (_members(groups[p.name]) if p.name in groups else [p])
    ]
    arguments = [p.replace(kind=p.KEYWORD_ONLY) for p in arguments]
    run.__signature__ = inspect.Signature(arguments)  # type: ignore[attr-defined]
    run.__annotations__ = {p.name: p.annotation for p in arguments}
    return run


def _members(group: Any) -> list[inspect.Parameter]:
    hints = get_type_hints(group, include_extras=True)
    return [
        inspect.Parameter(
            member.name,
            inspect.Parameter.KEYWORD_ONLY,
            default=inspect.Parameter.empty if member.default is MISSING else member.default,
            annotation=hints[member.name],
        )
        for member in fields(group)
    ]


def _option(parameter: Parameter, default: Any) -> inspect.Parameter:
    kind = parameter.kind
    typed = kind in TYPED_FIELDS or get_origin(kind) is Literal
    shown_type = kind if typed else str
    if parameter.repeated:
        shown_type = list[shown_type]  # type: ignore[valid-type]
    if default is None or parameter.repeated or not typed:
        shown_type = shown_type | None
    unit = f", {parameter.unit}" if parameter.unit and parameter.unit not in parameter.help else ""
    flag = "--" + parameter.word.replace("_", "-")
    info = typer.Option(flag, help=parameter.help + unit, metavar=parameter.metavar)
    plain = default if typed and not parameter.repeated else None
    return inspect.Parameter(
        parameter.field,
        inspect.Parameter.KEYWORD_ONLY,
        default=plain,
        annotation=Annotated[shown_type, info],
    )


def _value(parameter: Parameter, value: Any, default: Any) -> Any:
    """Return the value of a field; `value` is text where typer does not parse the field's type."""
    if value is None or value == []:
        return default
    if parameter.field == LABELS_FIELD:
        return text_decoding.merge_labels(
            text_decoding.parse_value(parameter, word) for word in value
        )
    if parameter.repeated and parameter.kind not in TYPED_FIELDS:
        return tuple(text_decoding.parse_value(parameter, word) for word in value)
    if isinstance(value, str) and get_origin(parameter.kind) is not Literal:
        return text_decoding.parse_value(parameter, value)
    return value


def parse_controls(pairs: Sequence[str]) -> dict[str, float]:
    """Return the controls of NAME=VALUE words; InvalidField for a malformed or repeated one."""
    controls: dict[str, float] = {}
    for pair in pairs:
        name, equals, value = pair.partition("=")
        if not equals or name in controls:
            raise InvalidField("control", f"{pair!r}, expected NAME=VALUE, each name once")
        try:
            controls[name] = float(value)
        except ValueError as fault:
            raise InvalidField(f"controls/{name}", f"{value!r}, expected a number") from fault
    return controls


@dataclass(frozen=True)
class CharacterOptions:
    """Character to which motions are delivered, and the roles of its joints."""

    character: Annotated[
        Path | None,
        typer.Option(
            help="USD or .glb file of a character that moves instead of the model's own",
            metavar="FILE",
        ),
    ] = None
    roles: Annotated[
        Path | None,
        typer.Option(
            help="TOML file with a table of roles, for joints of --character whose names do not "
            "tell them",
            metavar="FILE",
        ),
    ] = None

    def open(self, folder: Path) -> "UserCharacter | None":
        """Return the character to which files in a folder refer; None without one.

        Raises InvalidField for roles without a character, FileError for files that cannot be read.
        """
        if self.character is None:
            if self.roles is not None:
                raise InvalidField("roles", f"{self.roles} without --character, expected with it")
            return None
        # usd-core takes 0.12 CPU seconds to import.
        from posefield.characters import user_character

        reference = user_character.relative_reference(self.character, folder)
        roles = {} if self.roles is None else user_character.read_roles(self.roles)
        return user_character.open_character(self.character, reference, roles)

    def delivery(
        self, form: ClipEncoder, question: FileQuestion | PerformanceQuestion, output: Path
    ) -> "Delivery | None":
        """Return the delivery of answers to a file; None without a character.

        Raises as `open`, and InvalidField for what the file of a character cannot hold.
        """
        opened = self.open(output.absolute().parent)
        if opened is None:
            return None
        from posefield.characters import delivery

        return delivery.deliver(opened, form, question)

    def refuse(self, reason: str) -> None:
        """Raise InvalidField with a reason if a character or roles are given."""
        for option in ("character", "roles"):
            if getattr(self, option) is not None:
                raise InvalidField(option, f"given {reason}")
