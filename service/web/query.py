"""Questions as they travel: query parameters and JSON bodies, decoded into one shape.

What breaks the contract's form is refused here with 400; what a model cannot answer is left to
the model, which knows the ranges, and refused with 422.
"""

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, Literal, TypeVar, cast, get_args
from urllib.parse import parse_qsl

import msgspec

from service.encode.convention import Unit, Up
from service.motion.roles import Names
from service.synthesis import spelling
from service.synthesis.question import (
    FPS,
    HOLD,
    NAMES,
    POLICY,
    ROOT,
    ClipQuestion,
    Hold,
    Moment,
    Policy,
    PoseQuestion,
    Root,
    Target,
    When,
)
from service.synthesis.spelling import NUMBER
from service.web import decoding
from service.web.problems import BAD_PARAMETER, RequestFault, pointer

_ESCAPES = re.compile("[%+]")

Pairs = Sequence[tuple[str, str]]
"""Names and values of a query string in their order."""

Word = TypeVar("Word")
# get_args takes a microsecond.
_choices = cache(get_args)
FLAGS = {"true": True, "false": False}


@dataclass(frozen=True)
class FileQuestion:
    """Which clip, and what its file measures in; none for what is usual in its format."""

    clip: ClipQuestion
    unit: Unit | None = None
    up: Up | None = None


class TargetBody(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Schema Target of the contract."""

    joint: str
    position: tuple[float, float, float]
    time: float | msgspec.UnsetType = msgspec.UNSET
    at: Moment | msgspec.UnsetType = msgspec.UNSET


ExactBody = Literal["auto", "none"] | Annotated[list[str], msgspec.Meta(min_length=1)]
"""Schema Exact of the contract."""


class PoseBody(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Schema PoseQuestion of the contract."""

    controls: dict[str, msgspec.Raw]
    times: list[float]
    extrapolate: Policy = POLICY
    performer: str | None = None
    level: float = 0.0
    joint_sigma: bool = False
    exact: ExactBody = "auto"
    targets: list[TargetBody] = []
    pin_feet: bool = False


class ClipBody(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What the schemas ClipQuestion and NamedClipQuestion of the contract have in common."""

    controls: dict[str, msgspec.Raw]
    fps: float = FPS
    start: float = 0.0
    end: float | None = None
    extrapolate: Policy = POLICY
    performer: str | None = None
    level: float = 0.0
    names: Names = NAMES
    root: Root = ROOT
    loop: bool = False
    joint_sigma: bool = False
    exact: ExactBody = "auto"
    targets: list[TargetBody] = []
    pin_feet: bool = False


class FileBody(ClipBody, frozen=True):
    """Schema ClipQuestion of the contract."""

    unit: Unit | None = None
    up: Up | None = None


_POSE = msgspec.json.Decoder(PoseBody)
_FILE = msgspec.json.Decoder(FileBody)
_FLOAT = msgspec.json.Decoder(float)


def pairs(query_string: bytes) -> list[tuple[str, str]]:
    """Names and values of a query string."""
    text = query_string.decode("latin-1")
    if _ESCAPES.search(text):
        return parse_qsl(text, keep_blank_values=True)
    # As parse_qsl has it, in a fifth of its time.
    split = (part.partition("=") for part in text.split("&") if part)
    return [(name, value) for name, _, value in split]


def pose_of_pairs(pairs: Pairs) -> PoseQuestion:
    """Question of query parameters: `time` once or more, `target` any number of times, the others
    of the contract's pose paths, and one per control."""
    times = [number(name, text) for name, text in pairs if name == "time"]
    if not times:
        raise bad_parameter("time", "missing; give seconds from the start of the clip")
    single = unique([pair for pair in pairs if pair[0] not in ("time", "target")])
    policy, performer = policy_of(single), single.pop("performer", None)
    level = whole("level", single.pop("level", "0"))
    by_joint, hold = _flag(single, "joint_sigma"), _hold_of_pairs(pairs, single)
    return PoseQuestion(numbers_of(single), times, policy, performer, level, by_joint, hold)


def file_of_pairs(pairs: Pairs) -> FileQuestion:
    """Question of query parameters: those of the contract's clip paths, and one per control."""
    single = unique([pair for pair in pairs if pair[0] != "target"])
    unit: Unit | None = _word(single, "unit", _choices(Unit), None)
    up: Up | None = _word(single, "up", _choices(Up), None)
    hold = _hold_of_pairs(pairs, single)
    return FileQuestion(_clip_of_single(single, hold), unit, up)


def _hold_of_pairs(pairs: Pairs, single: dict[str, str]) -> Hold:
    """What an answer is held to: each `target`, and what is said once, which is taken out."""
    targets = tuple(_spelt("target", spelling.target, text) for n, text in pairs if n == "target")
    exact = single.pop("exact", None)
    pinned = _flag(single, "pin_feet")
    if exact is None and not targets and not pinned:
        return HOLD
    said = "auto" if exact is None else _spelt("exact", spelling.exact, exact)
    return Hold(said, targets, pinned)


def _spelt(name: str, read: Callable[[str], Word], text: str) -> Word:
    """What is read of a parameter's text; RequestFault where it cannot be."""
    try:
        return read(text)
    except ValueError as fault:
        raise bad_parameter(name, str(fault)) from None


def _clip_of_single(single: dict[str, str], hold: Hold) -> ClipQuestion:
    """Question of texts by name, of which none is left over: what is no option is a control."""
    policy, performer = policy_of(single), single.pop("performer", None)
    level = whole("level", single.pop("level", "0"))
    names = _word(single, "names", _choices(Names), NAMES)
    root = _word(single, "root", _choices(Root), ROOT)
    loop, by_joint = _flag(single, "loop"), _flag(single, "joint_sigma")
    numbers = numbers_of(single)
    return ClipQuestion(
        fps=numbers.pop("fps", FPS),
        start=numbers.pop("start", 0.0),
        end=numbers.pop("end", None),
        controls=numbers,
        extrapolate=policy,
        performer=performer,
        level=level,
        names=names,
        root=root,
        loop=loop,
        joint_sigma=by_joint,
        hold=hold,
    )


def pose_of_body(content: bytes) -> PoseQuestion:
    """Question of a JSON body."""
    body = decoding.decoded(_POSE, content)
    controls = controls_of(body.controls)
    level, hold = _level(body.level), _hold(body)
    policy, who, by_joint = body.extrapolate, body.performer, body.joint_sigma
    return PoseQuestion(controls, body.times, policy, who, level, by_joint, hold)


def file_of_body(content: bytes) -> FileQuestion:
    """Question of a JSON body."""
    body = decoding.decoded(_FILE, content)
    return FileQuestion(clip_of(body), body.unit, body.up)


def clip_of(body: ClipBody, *within: str) -> ClipQuestion:
    """Question of a part of a JSON body; within: keys and indices that lead to it."""
    return ClipQuestion(
        controls_of(body.controls, *within),
        body.fps,
        body.extrapolate,
        body.start,
        body.end,
        body.performer,
        _level(body.level, *within),
        body.names,
        body.root,
        body.loop,
        body.joint_sigma,
        _hold(body, *within),
    )


def _hold(body: PoseBody | ClipBody, *within: str) -> Hold:
    """What an answer is held to."""
    if body.exact == "auto" and not body.targets and not body.pin_feet:
        return HOLD
    targets = [_target(t, *within, "targets", str(i)) for i, t in enumerate(body.targets)]
    exact = tuple(body.exact) if isinstance(body.exact, list) else body.exact
    return Hold(exact, tuple(targets), body.pin_feet)


def _target(body: TargetBody, *within: str) -> Target:
    """Target of a body; RequestFault where it says not just one moment."""
    if (body.time is msgspec.UNSET) == (body.at is msgspec.UNSET):
        said = "neither time nor at" if body.at is msgspec.UNSET else "time and at"
        raise decoding.bad_body(f"{said}, expected one of them", pointer(*within))
    when = body.time if body.at is msgspec.UNSET else body.at
    return Target(body.joint, body.position, cast(When, when))


def unique(pairs: Pairs) -> dict[str, str]:
    """Texts by name; RequestFault for a name that is given twice."""
    single: dict[str, str] = {}
    for name, text in pairs:
        if name in single:
            raise bad_parameter(name, "given twice, expected once")
        single[name] = text
    return single


def policy_of(single: dict[str, str]) -> Policy:
    """What is said of `extrapolate`, which is taken out, or the usual."""
    return _word(single, "extrapolate", _choices(Policy), POLICY)


def _word(single: dict[str, str], name: str, choices: tuple[Any, ...], usual: Word) -> Word:
    """The text of that name, which is taken out, or the usual one; RequestFault where it is none of
    the choices."""
    text = single.pop(name, usual)
    if text is not usual and text not in choices:
        raise bad_parameter(name, f"{text!r}, expected one of {', '.join(choices)}")
    return cast(Word, text)


def _flag(single: dict[str, str], name: str) -> bool:
    """What is said under that name, which is taken out; false where nothing is."""
    return FLAGS[_word(single, name, tuple(FLAGS), "false")]


def numbers_of(texts: dict[str, str]) -> dict[str, float]:
    """Finite numbers of texts by name; RequestFault where one is none."""
    return sorted_by_name({name: number(name, text) for name, text in texts.items()})


def sorted_by_name(values: dict[str, float]) -> dict[str, float]:
    """The same in one order, so that the same question is written the same."""
    return dict(sorted(values.items()))


def number(name: str, text: str) -> float:
    """Finite number of a text; RequestFault where it is none."""
    value = float(text) if NUMBER.fullmatch(text) else math.nan
    if not math.isfinite(value):
        raise bad_parameter(name, f"{text!r}, expected a finite number")
    return value


def _level(given: float, *within: str) -> int:
    return whole_number("level", given, *within)


def whole_number(name: str, given: float, *within: str) -> int:
    """Whole number of a body's field; RequestFault where it is none."""
    # JSON has one kind of number: 1.0 is a whole one.
    if not given.is_integer():
        raise decoding.bad_body(f"{given:g}, expected a whole number", pointer(*within, name))
    return int(given)


def whole(name: str, text: str) -> int:
    """Whole number of a text; RequestFault where it is none."""
    # No level has ten digits; int would read as many as there are.
    if not re.fullmatch("[0-9]{1,9}", text, re.ASCII):
        raise bad_parameter(name, f"{text!r}, expected a whole number")
    return int(text)


def bad_parameter(name: str, detail: str) -> RequestFault:
    """Refusal of a query parameter."""
    return RequestFault(BAD_PARAMETER, f"{name}: {detail}", {"parameter": name})


def controls_of(raw: dict[str, msgspec.Raw], *within: str) -> dict[str, float]:
    """Values of the controls; decoded one by one because msgspec does not name a key at fault."""
    values = {}
    for name, text in raw.items():
        try:
            values[name] = _FLOAT.decode(text)
        except msgspec.ValidationError as fault:
            where = pointer(*within, "controls", name)
            raise decoding.bad_body(
                f"{fault} - at `{where}`, expected a finite number", where
            ) from None
    return sorted_by_name(values)
