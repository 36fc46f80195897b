"""Decoding of queries from text: the parameters of a URL, a command or a table.

A target as text is JOINT@MOMENT and a position in the frame of the clip, m:
`RightHand@end:0.3,1.2,0.4`. A moment is seconds from the start of the clip, or one of MOMENTS.
"""

import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from types import UnionType
from typing import (
    Annotated,
    Any,
    Literal,
    TypeVar,
    Union,
    cast,
    get_args,
    get_origin,
    get_type_hints,
)

from msgspec import NODEFAULT, Meta, Struct, structs

from posefield.common.errors import FormError, did_you_mean
from posefield.question.motion_question import (
    ExactControls,
    Floor,
    FloorValue,
    LabelValue,
    Moment,
    Target,
)
from posefield.question.walk_question import WalkerTake

Question = TypeVar("Question", bound=Struct)
MOMENTS: tuple[Moment, ...] = get_args(Moment)
# The number syntax of JSON, the same as in a body: no nan, inf, 1_000 or blanks.
NUMBER = re.compile(r"-?[0-9]+(\.[0-9]+)?([eE][+-]?[0-9]+)?", re.ASCII)
FLAGS = {"true": True, "false": False}
CONTROLS_FIELD, LABELS_FIELD = "controls", "labels"


@dataclass(frozen=True)
class Parameter:
    """Field of a query as a text parameter.

    word: its name in text. kind: type of one value. read: converts a text to a value, and raises
    ValueError for an invalid one. repeated: whether it may occur several times, once per value.
    default: NODEFAULT for a field that a query must contain.
    """

    field: str
    word: str
    kind: Any
    read: Callable[[str], Any]
    repeated: bool
    default: Any
    help: str
    unit: str | None
    metavar: str | None


@cache
def parameters(form: type[Struct]) -> Mapping[str, Parameter]:
    """Return the parameters of a query by name, without the controls."""
    hints = get_type_hints(form, include_extras=True)
    listed = [
        _parameter(field, hints[field.name])
        for field in structs.fields(form)
        if field.name != CONTROLS_FIELD
    ]
    return {parameter.word: parameter for parameter in listed}


def decode_question(form: type[Question], pairs: Iterable[tuple[str, str]]) -> Question:
    """Return the query of names and texts; a name that is not a parameter is a control.

    Raises FormError for an invalid text, a name that occurs twice and one that is missing, and the
    errors of the query's own checks.
    """
    form_parameters, values, controls = parameters(form), dict[str, Any](), dict[str, float]()
    for name, text in pairs:
        parameter = form_parameters.get(name)
        read: Callable[[str], Any] = parse_number
        field, target, repeated = name, controls, False
        if parameter is not None:
            read, field, target = parameter.read, parameter.field, values
            repeated = parameter.repeated
        if field in target and not repeated:
            raise FormError(name, "given twice, expected once")
        try:
            value = read(text)
        except ValueError as fault:
            raise FormError(name, str(fault)) from None
        if repeated:
            values.setdefault(field, []).append(value)
        else:
            target[field] = value
    for parameter in form_parameters.values():
        if parameter.default is NODEFAULT and parameter.field not in values:
            expected = parameter.help or "the name of a control"
            raise FormError(parameter.word, f"missing, expected {expected}")
    if CONTROLS_FIELD in form.__struct_fields__:
        values[CONTROLS_FIELD] = controls
    if "targets" in values:
        values["targets"] = tuple(values["targets"])
    if LABELS_FIELD in values:
        values[LABELS_FIELD] = merge_labels(values[LABELS_FIELD])
    return form(**values)


def merge_labels(pairs: Iterable[tuple[str, LabelValue]]) -> dict[str, LabelValue]:
    """Return the labels by set; FormError for a set that is given twice."""
    labels: dict[str, LabelValue] = {}
    for name, value in pairs:
        if name in labels:
            raise FormError("label", f"{name} given twice, expected once")
        labels[name] = value
    return labels


def parse_value(parameter: Parameter, text: str) -> Any:
    """Return the value of a parameter's text.

    Raises FormError for an invalid text.
    """
    try:
        return parameter.read(text)
    except ValueError as fault:
        raise FormError(parameter.word, str(fault)) from None


def parse_number(text: str) -> float:
    """Return the finite number of a text.

    Raises ValueError for any other text.
    """
    number = float(text) if NUMBER.fullmatch(text) else math.nan
    if not math.isfinite(number):
        raise ValueError(f"{text!r}, expected a finite number")
    return number


def parse_integer(text: str) -> int:
    """Return the whole number of a text.

    Raises ValueError for any other text.
    """
    # As in a body, 2.0 is 2. Whole numbers of queries are below ten digits.
    number = float(text) if NUMBER.fullmatch(text) else math.nan
    if not (number.is_integer() and 0 <= number < 1e9):
        raise ValueError(f"{text!r}, expected a whole number")
    return int(number)


def choice_parser(choices: tuple[str, ...]) -> Callable[[str], str]:
    """Return a function that accepts one of the choices, and raises ValueError for others."""

    def read(text: str) -> str:
        if text not in choices:
            detail = f"{text!r}{did_you_mean(text, choices)}"
            raise ValueError(f"{detail}, expected one of {', '.join(choices)}")
        return text

    return read


def parse_position(text: str) -> tuple[float, float, float]:
    """Return the three numbers of a text, separated by commas, m.

    Raises ValueError for any other text.
    """
    try:
        x, y, z = map(parse_number, text.split(","))
    except ValueError:
        raise ValueError(f"{text!r}, expected x,y,z in metres") from None
    return x, y, z


def parse_floor(text: str) -> FloorValue:
    """Return the height, or the plane, of HEIGHT or HEIGHT,SLOPE_X,SLOPE_Z.

    Raises ValueError for any other text.
    """
    try:
        numbers = [parse_number(number) for number in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in (1, 3):
        raise ValueError(f"{text!r}, expected a height or height,slope_x,slope_z in metres")
    return numbers[0] if len(numbers) == 1 else Floor(*numbers)


def parse_flag(text: str) -> bool:
    """Return the boolean of "true" or "false".

    Raises ValueError for any other text.
    """
    return FLAGS[choice_parser(tuple(FLAGS))(text)]


def parse_exact(text: str) -> ExactControls:
    """Return auto, none, or names of controls separated by commas.

    Raises ValueError for any other text.
    """
    if text in ("auto", "none"):
        return cast(ExactControls, text)
    names = tuple(text.split(","))
    if "" in names:
        raise ValueError(f"{text!r}, expected auto, none or names of controls, commas between")
    return names


def parse_walker_take(text: str) -> WalkerTake:
    """Return a seed, or index.

    Raises ValueError for any other text.
    """
    if text == "index":
        return "index"
    try:
        return parse_integer(text)
    except ValueError:
        raise ValueError(f"{text!r}, expected a whole number or index") from None


def parse_target(text: str) -> Target:
    """Return the target of a text.

    Raises ValueError for an invalid text.
    """
    mark = max(text.rfind(":"), text.rfind("="))
    joint, _, moment = text[: max(mark, 0)].rpartition("@")
    try:
        position = parse_position(text[mark + 1 :])
        when = {"at": moment} if moment in MOMENTS else {"time": parse_number(moment)}
    except ValueError:
        joint = ""
    if not joint:
        raise ValueError(
            f"{text!r}, expected JOINT@MOMENT:X,Y,Z, m; a moment is seconds or one of "
            f"{', '.join(MOMENTS)}"
        )
    return Target(joint, position, **when)


def parse_label(text: str) -> tuple[str, LabelValue]:
    """Return label set and value of SET=NAME or SET=NAME:WEIGHT,NAME:WEIGHT.

    Raises ValueError for any other text.
    """
    name, mark, value = text.partition("=")
    if not (name and mark and value):
        raise ValueError(f"{text!r}, expected SET=NAME or SET=NAME:WEIGHT,NAME:WEIGHT")
    return name, parse_label_value(value)


def parse_label_value(text: str) -> LabelValue:
    """Return a name, or the weights of NAME:WEIGHT,NAME:WEIGHT.

    Names have neither commas nor colons. Raises ValueError for any other text.
    """
    if "," not in text and ":" not in text:
        return text
    pairs = [pair.rpartition(":") for pair in text.split(",")]
    try:
        weights = {name: parse_number(weight) for name, _, weight in pairs}
    except ValueError:
        weights = {}
    if "" in weights or len(weights) < len(pairs):
        raise ValueError(f"{text!r}, expected NAME or NAME:WEIGHT,NAME:WEIGHT, each name once")
    return dict(weights)


PARSERS: Mapping[Any, Callable[[str], Any]] = {
    dict[str, LabelValue]: parse_label,
    float: parse_number,
    int: parse_integer,
    bool: parse_flag,
    str: str,
    ExactControls: parse_exact,
    FloorValue: parse_floor,
    Target: parse_target,
    WalkerTake: parse_walker_take,
    tuple[float, float, float]: parse_position,
}
"""Function that reads a text, by type of field; literals have their choices instead."""


def _parameter(field: structs.FieldInfo, hint: Any) -> Parameter:
    kind, meta = hint, Meta()
    if get_origin(hint) is Annotated and isinstance(get_args(hint)[1], Meta):
        # The last one describes the field; others are bounds of its type.
        kind, *_, meta = get_args(hint)
    kind = _without_none(kind)
    several = get_origin(kind) in (list, tuple) and kind not in PARSERS
    # Each label set of a mapping is a parameter of its own.
    repeated = several or field.name == LABELS_FIELD
    one = _without_annotations(get_args(kind)[0] if several else kind)
    read = choice_parser(get_args(one)) if get_origin(one) is Literal else PARSERS[one]
    extra = meta.extra or {}
    return Parameter(
        field.name,
        extra.get("word", field.name),
        one,
        read,
        repeated,
        field.default if field.default_factory is NODEFAULT else field.default_factory(),
        meta.description or "",
        extra.get("unit"),
        extra.get("metavar"),
    )


def _without_none(kind: Any) -> Any:
    if get_origin(kind) not in (Union, UnionType) or type(None) not in get_args(kind):
        return kind
    members = [member for member in get_args(kind) if member is not type(None)]
    return members[0] if len(members) == 1 else Union[tuple(members)]  # noqa: UP007  # built at run time


def _without_annotations(kind: Any) -> Any:
    return get_args(kind)[0] if get_origin(kind) is Annotated else kind
