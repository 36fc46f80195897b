"""Scripts of performances: their requests, results, and the lines of errors in them."""

import json
import math
from dataclasses import dataclass
from typing import Any, NoReturn

from . import clips, faults
from .clips import Clip
from .service import Service, fetch

PATH = "/v1/performances.npz"
OWN = {"unit": "m", "up": "y"}
"""Fields that the add-on sets itself; it turns motion with Y up in metres to Blender's axes."""

_DECODER = json.JSONDecoder()


@dataclass(frozen=True)
class Moment:
    """A moment of a performance, for a marker. time: s. words: its name."""

    time: float
    words: str


def ask(service: Service, text: str, fps: float) -> Clip:
    """Return the performance of a script as a clip. fps: for a script without a frame rate.

    Raises Fault: one about the script names the line, and has it as `line`.
    """
    try:
        return decode(fetch(service, PATH, {"fps": fps} | body(text) | OWN))
    except faults.Refused as fault:
        if fault.pointer is None:
            raise
        raise faults.InScript(str(fault), fault.pointer, line_of(text, fault.pointer)) from fault


def body(text: str) -> dict[str, Any]:
    """Return a script as JSON; raise InScript for anything else, and for fields in OWN."""
    try:
        found = json.loads(text, parse_constant=_refuse)
    except json.JSONDecodeError as fault:
        raise faults.InScript(f"no JSON: {fault.msg}", "", fault.lineno) from fault
    except (ValueError, RecursionError) as fault:
        raise faults.InScript(f"no JSON: {fault}", "", 1) from fault
    if not isinstance(found, dict):
        raise faults.InScript("no JSON object, expected one with segments", "", 1)
    for name in OWN:
        if name in found:
            pointer = f"/{name}"
            words = f"{name} is {found[name]!r}, expected none: the add-on sets it"
            raise faults.InScript(words, pointer, line_of(text, pointer))
    return found


def decode(content: bytes) -> Clip:
    """Return the performance of an npz file; Unintelligible describes an error."""
    return clips.decode(content, _check_report)


def character(clip: Clip) -> str:
    """Return the model that a performance has the bones of, as name@hash."""
    return str(clip.trust["character"])


def moments(clip: Clip) -> list[Moment]:
    """Return the begins of the segments with their joins, and the events, in order of time."""
    joins = {each["segment"]: each for each in clip.trust["joins"]}
    found = []
    for index, own in enumerate(clip.trust["segments"]):
        words = " ".join(filter(None, (str(index), own["kind"], _name(own))))
        found.append(Moment(own["begins"], words + _joined(joins.get(index))))
        if "event" in own:
            found.append(Moment(own["event"], f"{index} event"))
    return sorted(found, key=lambda each: each.time)


def sentences(clip: Clip, text: str) -> list[str]:
    """Return the warnings of a performance, each with the line of the script."""
    said = []
    for each in clip.trust["warnings"]:
        line = line_of(text, each["pointer"])
        said.append(f"line {line}, {each['pointer']}: {each['message']}")
    return said


def line_of(text: str, pointer: str) -> int:
    """Return the line, from 1, of the value that a JSON pointer names in a text.

    Of a value that is not there it is the line of the innermost one around it that is.
    """
    place = _blank(text, 0)
    for key in _keys(pointer):
        inner = _inner(text, place, key)
        if inner is None:
            break
        place = inner
    return text.count("\n", 0, place) + 1


def _keys(pointer: str) -> list[str]:
    parts = pointer.split("/")[1:]
    return [each.replace("~1", "/").replace("~0", "~") for each in parts]


def _inner(text: str, place: int, key: str) -> int | None:
    """Return the place of an entry of the object or list at a place; None if there is none."""
    kind = text[place]
    at = _blank(text, place + 1)
    count = 0
    while kind in "{[" and text[at] not in "}]":
        name = str(count)
        if kind == "{":
            name, at = _DECODER.raw_decode(text, at)
            at = _blank(text, _blank(text, at) + 1)
        if name == key:
            return at
        at = _blank(text, _DECODER.raw_decode(text, at)[1])
        at = _blank(text, at + 1) if text[at] == "," else at
        count += 1
    return None


def _blank(text: str, place: int) -> int:
    """Return the next place that has no blank."""
    while place < len(text) and text[place] in " \t\r\n":
        place += 1
    return place


def _refuse(name: str) -> NoReturn:
    raise ValueError(f"{name}, expected a finite number")


def _name(segment: dict[str, Any]) -> str:
    return "" if segment["kind"] == "hold" else str(segment["model"]).partition("@")[0]


def _joined(join: dict[str, Any] | None) -> str:
    if join is None:
        return ""
    return f" ({'hard join' if join['hard'] else 'join'}, {100.0 * join['distance']:.0f} cm)"


def _check_report(trust: dict[str, Any]) -> None:
    """Raise ValueError or KeyError for a report without what the add-on shows."""
    segments = [(each["kind"], each["model"], each["begins"]) for each in trust["segments"]]
    joins = [(each["segment"], each["distance"], each["hard"]) for each in trust["joins"]]
    warnings = [(each["pointer"], each["message"]) for each in trust["warnings"]]
    times = [begins for _, _, begins in segments]
    times += [each["event"] for each in trust["segments"] if "event" in each]
    numbers = [trust["sigma"], *times, *(distance for _, distance, _ in joins)]
    texts = [trust["character"], *(text for each in warnings for text in each)]
    known = all(isinstance(each, str) for each in texts)
    if not (segments and known and all(map(math.isfinite, numbers))):
        raise ValueError("a report without segments, or with times that are not finite")
