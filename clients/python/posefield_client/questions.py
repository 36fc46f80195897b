"""Questions as HTTP requests: GET, which can be cached, or POST for long ones."""

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from difflib import get_close_matches
from pathlib import Path
from typing import Any, Literal, TypeVar
from urllib.parse import quote_plus

import msgspec
import numpy as np
import numpy.typing as npt

from posefield_client.errors import WrongQuestion
from posefield_client.generated import OPERATIONS, Floor, ManifestEntry, PerformanceEntry, Target
from posefield_client.wire import Call, Reply

T = TypeVar("T")
Controls = Mapping[str, float]
Labels = Mapping[str, str | Mapping[str, float]]
"""Name, or weights of names, by label set: {"style": {"angry": 0.7, "happy": 0.3}}."""
Exact = Literal["auto", "none"] | str | Sequence[str]
"""The service's default, none, or the names of measured controls."""
FloorValue = float | Floor | Mapping[str, float]
"""Height of a level floor, m, or a plane."""
Times = float | Sequence[float] | npt.NDArray[Any]
Targets = Iterable[Target | Mapping[str, Any]]
Entry = ManifestEntry | PerformanceEntry
"""Line of a manifest: of an archive of clips, or of one of performances."""

MODEL_NAME = re.compile(r"[a-z0-9][a-z0-9_-]{0,63}(@[0-9a-f]{16})?", re.ASCII)
LONGEST = 4000
"""Longest path and query of a GET request; services accept 8,192 characters by default."""


def question(arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return a question from the arguments of a method: its own names, `controls` and `named`.

    Arguments that are None are left out: they take the defaults of the contract.
    """
    given = {key: value for key, value in arguments.items() if value is not None}
    for name in ("self", "model"):
        given.pop(name, None)
    if "named" in given:
        given = {"controls": {**given.pop("controls", {}), **given.pop("named")}, **given}
    if isinstance(exact := given.get("exact"), str) and exact not in ("auto", "none"):
        given["exact"] = [exact]
    if "times" in given and not isinstance(given["times"], list | tuple):
        given["times"] = np.atleast_1d(given["times"])
    return {key: plain(key, value) for key, value in given.items()}


def plain(name: str, value: Any) -> Any:
    """Return a value as JSON types, recursively; WrongQuestion if that is impossible."""
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {key: plain(key, part) for key, part in value.items()}
    if value is None or isinstance(value, bool | str):
        return value
    if isinstance(value, int | float):
        # JSON would encode a non-finite number as null, which has another meaning.
        if isinstance(value, float) and not math.isfinite(value):
            raise WrongQuestion(f"{name} is {value!r}, expected a finite number")
        return value
    if isinstance(value, Iterable) and not isinstance(value, bytes):
        return [plain(name, part) for part in value]
    raise WrongQuestion(f"{name} is {value!r}, expected numbers, texts, lists or mappings")


def get(
    operation: str, model: str, words: Mapping[str, Any], read: Callable[[Reply], T], form: str = ""
) -> Call[T]:
    """Return a GET request. form: the format at the end of its path; empty without one."""
    kind = OPERATIONS[operation].in_format(form)
    query = "&".join(f"{quote_plus(key)}={_text(value)}" for key, value in _parameters(words))
    path = kind.path.replace("{model}", model)
    return Call(kind, f"{path}?{query}" if query else path, read)


def post(
    operation: str,
    model: str,
    body: Mapping[str, Any],
    read: Callable[[Reply], T],
    form: str = "",
    query: str = "",
) -> Call[T]:
    """Return a POST request. form: the format at the end of its path; empty without one."""
    kind = OPERATIONS[operation].in_format(form)
    path = kind.path.replace("{model}", model)
    return Call(kind, path + query, read, msgspec.json.encode(body))


def ask(
    noun: str, model: str, words: Mapping[str, Any], read: Callable[[Reply], T], form: str = ""
) -> Call[T]:
    """Return a get<noun> request, or query<noun> if its path and query exceed LONGEST."""
    call = get(f"get{noun}", model, words, read, form)
    return call if len(call.target) <= LONGEST else post(f"query{noun}", model, words, read, form)


def _parameters(words: Mapping[str, Any]) -> Iterable[tuple[str, Any]]:
    """Return a question as query parameters, with one parameter per control."""
    for key, value in words.items():
        if key == "controls":
            yield from value.items()
        elif key == "times":
            yield from (("time", time) for time in value)
        elif key == "targets":
            yield from (("target", _target(target)) for target in value)
        elif key == "labels":
            yield from (("label", f"{name}={_label(label)}") for name, label in value.items())
        elif key == "floor" and isinstance(value, Mapping):
            yield key, _joined(value.get(part) for part in ("height", "slope_x", "slope_z"))
        elif isinstance(value, list):
            yield key, _joined(value)
        else:
            yield key, value


def _label(value: str | Mapping[str, float]) -> str:
    """Return a label's NAME, or NAME:WEIGHT,NAME:WEIGHT."""
    if isinstance(value, str):
        return value
    return ",".join(f"{name}:{digits(weight)}" for name, weight in value.items())


def _target(target: Mapping[str, Any]) -> str:
    """Return a target as JOINT@MOMENT:X,Y,Z."""
    if ("time" in target) == ("at" in target):
        raise WrongQuestion(f"target {dict(target)}: expected one of time and at")
    moment = target["at"] if "at" in target else digits(target["time"])
    return f"{target.get('joint')}@{moment}:{_joined(target.get('position', ()))}"


def _joined(values: Iterable[Any]) -> str:
    return ",".join(map(digits, values))


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return quote_plus(digits(value))


def digits(value: Any) -> str:
    """Return a number without an exponent, because a query decodes "+" as a space."""
    text = str(value)
    is_exponential = isinstance(value, float) and "e" in text
    return format(Decimal(text), "f") if is_exponential else text


def check_names(names: Iterable[str], known: Sequence[str]) -> None:
    """Raise WrongQuestion for a control that is none of the known ones."""
    for name in names:
        if name not in known:
            hint = "".join(f" (did you mean {n!r}?)" for n in get_close_matches(name, known, 1))
            raise WrongQuestion(f"{name}: no such control, expected {', '.join(known)}{hint}")


def model_name(name: str) -> str:
    """Return the name; raise WrongQuestion if it is not a valid model name."""
    if MODEL_NAME.fullmatch(name) is None:
        raise WrongQuestion(f"model {name!r}, expected a name or name@hash")
    return name


@dataclass(frozen=True)
class Files:
    """Request with a file as result.

    call: makes it from a decoder and a format. operation: that has the formats. count: number of
    clips of an archive, else None. about: the question, for people. entry: form of the lines of an
    archive's manifest.
    """

    call: Callable[[Callable[[Reply], Any], str], Call[Any]]
    operation: str
    about: str
    count: int | None = None
    entry: type[Entry] = ManifestEntry

    def ending(self, name: str) -> str:
        """Return the format that the name of a file ends in: the longest, such as mjlab.npz."""
        double = [form for form in OPERATIONS[self.operation].formats if "." in form]
        endings = (form for form in double if name.lower().endswith(f".{form}"))
        return next(endings, Path(name).suffix[1:].lower())

    def request(self, form: str, read: Callable[[Reply], T]) -> Call[T]:
        """Return the request for a format; WrongQuestion for an unknown one."""
        formats = OPERATIONS[self.operation].formats
        if form not in formats:
            raise WrongQuestion(f"format {form!r}, expected one of {', '.join(formats)}")
        return self.call(read, form)


def about(model: str, words: Mapping[str, Any]) -> str:
    """Return a model and a question as the arguments of a call, for people; long lists are cut."""
    given = {**words.get("controls", {}), **words}
    given.pop("controls", None)
    texts = (f"{key}={_short(value)}" for key, value in given.items())
    return ", ".join([repr(model), *texts])


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"<{len(value)} items>"
