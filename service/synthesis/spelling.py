"""What an answer is held to, as words and as plain values say it.

A target in words is JOINT@MOMENT and a place: `RightHand@end:0.3,1.2,0.4`, in the frame of the
clip, m. A moment is seconds from the start of the clip, or one of MOMENTS.
"""

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any, cast, get_args

from service.motion.errors import InvalidField
from service.synthesis.question import HOLD, Exact, Hold, Moment, Target, When

MOMENTS: tuple[Moment, ...] = get_args(Moment)
# What JSON calls a number, so that words read like a body: no nan, inf, 1_000 or blanks.
NUMBER = re.compile(r"-?[0-9]+(\.[0-9]+)?([eE][+-]?[0-9]+)?", re.ASCII)
AXES = 3


def target(words: str, mark: str = ":") -> Target:
    """Target of words; mark: what stands before the place. ValueError says what was expected."""
    head, _, place = words.rpartition(mark)
    joint, _, moment = head.rpartition("@")
    position = tuple(_number(word) for word in place.split(","))
    when: When | None = moment if moment in MOMENTS else _number(moment)
    if not joint or len(position) != AXES or None in position or when is None:
        raise ValueError(
            f"{words!r}, expected JOINT@MOMENT{mark}X,Y,Z, m; a moment is seconds or one of "
            f"{', '.join(MOMENTS)}"
        )
    return Target(joint, cast(tuple[float, float, float], position), when)


def hold(exact_words: str | None, targets: Sequence[str], pin_feet: bool) -> Hold:
    """What a command line says: targets as JOINT@MOMENT=X,Y,Z. InvalidField for words that are
    none."""
    if exact_words is None and not targets and not pin_feet:
        return HOLD
    try:
        said = "auto" if exact_words is None else exact(exact_words)
    except ValueError as fault:
        raise InvalidField("exact", str(fault)) from fault
    try:
        found = tuple(target(words, "=") for words in targets)
    except ValueError as fault:
        raise InvalidField("target", str(fault)) from fault
    return Hold(said, found, pin_feet)


def plain_target(found: object) -> Target:
    """Target of an object with joint, position and time or at; ValueError where it is none."""
    if not isinstance(found, Mapping) or not _is_target(found):
        raise ValueError(
            f"{found!r}, expected joint, position (three numbers, m) and either time, s, or at "
            f"({', '.join(MOMENTS)})"
        )
    x, y, z = map(float, found["position"])
    return Target(found["joint"], (x, y, z), found["at"] if "at" in found else found["time"])


def exact(words: str) -> Exact:
    """auto, none, or names of controls separated by commas; ValueError for an empty one."""
    if words in ("auto", "none"):
        return cast(Exact, words)
    names = tuple(words.split(","))
    if "" in names:
        raise ValueError(f"{words!r}, expected auto, none or names of controls, commas between")
    return names


def _is_target(found: Mapping[Any, Any]) -> bool:
    position, moments = found.get("position"), found.keys() - {"joint", "position"}
    return (
        isinstance(found.get("joint"), str)
        and isinstance(position, list)
        and len(position) == AXES
        and all(map(_is_number, position))
        and ((moments == {"time"} and _is_number(found["time"])) or _has_moment(moments, found))
    )


def _has_moment(keys: set[Any], found: Mapping[Any, Any]) -> bool:
    return keys == {"at"} and isinstance(found["at"], str) and found["at"] in MOMENTS


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _number(word: str) -> float | None:
    """Finite number of a word; None where it is none."""
    value = float(word) if NUMBER.fullmatch(word) else math.nan
    return value if math.isfinite(value) else None
