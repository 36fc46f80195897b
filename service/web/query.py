"""Questions as they travel: query parameters and JSON bodies, decoded into one shape.

What breaks the contract's form is refused here with 400; what a model cannot answer is left to
the model, which knows the ranges, and refused with 422.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast, get_args

import msgspec

from service.synthesis.question import FPS, POLICY, ClipQuestion, Policy
from service.web import decoding
from service.web.problems import BAD_PARAMETER, RequestFault, pointer

# What JSON calls a number, so that a query reads like a body: no nan, inf, 1_000 or blanks.
NUMBER = re.compile(r"-?[0-9]+(\.[0-9]+)?([eE][+-]?[0-9]+)?", re.ASCII)

Pairs = Sequence[tuple[str, str]]
"""Names and values of a query string in their order."""


@dataclass(frozen=True)
class PoseQuestion:
    """Which poses: control values and times, s, who moves, nobody that was seen for none, and the
    level of detail."""

    controls: dict[str, float]
    times: list[float]
    extrapolate: Policy
    performer: str | None = None
    level: int = 0


class PoseBody(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Schema PoseQuestion of the contract."""

    controls: dict[str, msgspec.Raw]
    times: list[float]
    extrapolate: Policy = POLICY
    performer: str | None = None
    level: float = 0.0


class ClipBody(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Schema ClipQuestion of the contract."""

    controls: dict[str, msgspec.Raw]
    fps: float = FPS
    start: float = 0.0
    end: float | None = None
    extrapolate: Policy = POLICY
    performer: str | None = None
    level: float = 0.0


_POSE = msgspec.json.Decoder(PoseBody)
_CLIP = msgspec.json.Decoder(ClipBody)
_FLOAT = msgspec.json.Decoder(float)


def pose_of_pairs(pairs: Pairs) -> PoseQuestion:
    """Question of query parameters: `time` once or more, extrapolate, performer, level, and one
    per control."""
    times = [number(name, text) for name, text in pairs if name == "time"]
    if not times:
        raise bad_parameter("time", "missing; give seconds from the start of the clip")
    single = unique([pair for pair in pairs if pair[0] != "time"])
    policy, performer = _policy(single.pop("extrapolate", POLICY)), single.pop("performer", None)
    level = whole("level", single.pop("level", "0"))
    return PoseQuestion(_numbers(single), times, policy, performer, level)


def clip_of_pairs(pairs: Pairs) -> ClipQuestion:
    """Question of query parameters: fps, start, end, extrapolate, performer, level, and one per
    control."""
    single = unique(pairs)
    policy, performer = _policy(single.pop("extrapolate", POLICY)), single.pop("performer", None)
    level = whole("level", single.pop("level", "0"))
    numbers = _numbers(single)
    return ClipQuestion(
        fps=numbers.pop("fps", FPS),
        start=numbers.pop("start", 0.0),
        end=numbers.pop("end", None),
        controls=numbers,
        extrapolate=policy,
        performer=performer,
        level=level,
    )


def pose_of_body(content: bytes) -> PoseQuestion:
    """Question of a JSON body."""
    body = decoding.decoded(_POSE, content)
    controls = _controls(body.controls)
    level = _level(body.level)
    return PoseQuestion(controls, body.times, body.extrapolate, body.performer, level)


def clip_of_body(content: bytes) -> ClipQuestion:
    """Question of a JSON body."""
    return clip_of(decoding.decoded(_CLIP, content))


def clip_of(body: ClipBody, *within: str) -> ClipQuestion:
    """Question of a part of a JSON body; within: keys and indices that lead to it."""
    return ClipQuestion(
        _controls(body.controls, *within),
        body.fps,
        body.extrapolate,
        body.start,
        body.end,
        body.performer,
        _level(body.level, *within),
    )


def unique(pairs: Pairs) -> dict[str, str]:
    """Texts by name; RequestFault for a name that is given twice."""
    single: dict[str, str] = {}
    for name, text in pairs:
        if name in single:
            raise bad_parameter(name, "given twice, expected once")
        single[name] = text
    return single


def _policy(text: str) -> Policy:
    if text not in get_args(Policy):
        raise bad_parameter("extrapolate", f"{text!r}, expected one of {get_args(Policy)}")
    return cast(Policy, text)


def _numbers(texts: dict[str, str]) -> dict[str, float]:
    return {name: number(name, text) for name, text in texts.items()}


def number(name: str, text: str) -> float:
    """Finite number of a text; RequestFault where it is none."""
    value = float(text) if NUMBER.fullmatch(text) else math.nan
    if not math.isfinite(value):
        raise bad_parameter(name, f"{text!r}, expected a finite number")
    return value


def _level(given: float, *within: str) -> int:
    # JSON has one kind of number: 1.0 is a whole one.
    if not given.is_integer():
        raise decoding.bad_body(f"{given:g}, expected a whole number", pointer(*within, "level"))
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


def _controls(raw: dict[str, msgspec.Raw], *within: str) -> dict[str, float]:
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
    return values
