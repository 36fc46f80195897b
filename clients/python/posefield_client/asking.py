"""HTTP requests from arguments: GET, which can be cached, or POST for long queries."""

import math
import re
from collections.abc import Iterable, Mapping
from decimal import Decimal
from difflib import get_close_matches
from typing import Any
from urllib.parse import quote_plus

import msgspec
import numpy as np
import numpy.typing as npt
from msgspec import UNSET, Struct

from posefield_client.errors import WrongQuestion
from posefield_client.generated import (
    OPERATIONS,
    Act,
    ClipQuestion,
    CrowdQuestion,
    Floor,
    Operation,
    PerformanceQuestion,
    PoseQuestion,
    Target,
    Walk,
)
from posefield_client.wire import Request

MODEL_NAME = re.compile(r"[a-z0-9][a-z0-9_-]{0,63}(@[0-9a-f]{16})?", re.ASCII)
LONGEST = 4000
"""Longest path and query of a GET request; services accept 8,192 characters by default."""
_SAID_OTHERWISE = {"times": "time"}
LONGEST_NAME = 40
"""Longest name that is compared with known ones."""
OPTIONS = sorted(
    {
        name
        for form in (PoseQuestion, ClipQuestion, CrowdQuestion, PerformanceQuestion, Walk, Act)
        for name in form.__struct_fields__
    }
)
"""Options of questions: an argument of another name is taken for a control."""


def plain(
    name: str, model: str, words: Mapping[str, Any] | None = None, form: str | None = None
) -> Request:
    """Return a GET request. form: the format at the end of its path; None without format."""
    operation = _operation(name, form)
    return Request(operation, _target(operation, model, words or {}))


def body(name: str, model: str, question: Struct, form: str | None = None) -> Request:
    """Return a POST request. form: the format at the end of its path; None without format."""
    operation = _operation(name, form)
    content = msgspec.json.encode(sayable(name, question))
    return Request(operation, _target(operation, model, {}), content)


def either(noun: str, model: str, question: Struct, form: str | None = None) -> Request:
    """Return a get<noun> request, or query<noun> if its path and query exceed LONGEST.

    form: the format at the end of its path; None without format.
    """
    asked = plain(f"get{noun}", model, _words(question), form)
    return asked if len(asked.target) <= LONGEST else body(f"query{noun}", model, question, form)


def _operation(name: str, form: str | None) -> Operation:
    found = OPERATIONS[name]
    return found if form is None else found.in_format(form)


def _words(question: Struct) -> dict[str, Any]:
    """Return a question as query parameters, with one parameter per control."""
    words: dict[str, Any] = {}
    for key in question.__struct_fields__:
        value = getattr(question, key)
        if key == "controls":
            words.update(value)
        elif key == "exact" and isinstance(value, tuple):
            words[key] = ",".join(value)
        elif key == "targets" and value is not UNSET:
            words["target"] = tuple(map(_spelt, value))
        elif key == "floor" and isinstance(value, Floor):
            words[key] = ",".join(map(digits, (value.height, value.slope_x, value.slope_z)))
        elif key == "labels" and value is not UNSET:
            words.update(label_words(value))
        elif value is not UNSET:
            words[_SAID_OTHERWISE.get(key, key)] = value
    return words


def label_words(labels: Mapping[str, str | Mapping[str, float]]) -> dict[str, Any]:
    """Return labels as query parameters: SET=NAME, or SET=NAME:WEIGHT,NAME:WEIGHT."""
    texts = (f"{name}={_label_text(value)}" for name, value in labels.items())
    return {"label": tuple(texts)} if labels else {}


def _label_text(value: str | Mapping[str, float]) -> str:
    if isinstance(value, str):
        return value
    return ",".join(f"{name}:{digits(float(weight))}" for name, weight in value.items())


def _spelt(target: Target) -> str:
    """Return a target as the value of a query parameter."""
    moment = target.at if target.time is UNSET else digits(target.time)
    return f"{target.joint}@{moment}:{','.join(map(digits, target.position))}"


def _target(operation: Operation, model: str, words: Mapping[str, Any]) -> str:
    path = operation.path.replace("{model}", model)
    query = "&".join(_pairs(words))
    return f"{path}?{query}" if query else path


def _pairs(words: Mapping[str, Any]) -> Iterable[str]:
    for key, value in words.items():
        name = quote_plus(key)
        for each in value if isinstance(value, tuple) else (value,):
            yield f"{name}={_text(each)}"


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return quote_plus(value if isinstance(value, str) else digits(value))


def digits(value: Any) -> str:
    """Return a number without an exponent, because a query decodes "+" as a space."""
    text = repr(value)
    return format(Decimal(text), "f") if "e" in text else text


def model_name(name: str) -> str:
    """Return the name; raise WrongQuestion if it is not a valid model name."""
    if MODEL_NAME.fullmatch(name) is None:
        raise WrongQuestion(f"model {name!r}, expected a name or name@hash")
    return name


def number(name: str, value: Any) -> float:
    """Return a finite number as a Python int or float; NumPy scalars are accepted."""
    found = value.item() if isinstance(value, np.generic) else value
    if type(found) not in (int, float) or not _is_finite(found):
        known = isinstance(found, int | float) or name in OPTIONS
        hint = "" if known else did_you_mean(name, OPTIONS)
        raise WrongQuestion(f"{name}{hint} is {value!r}, expected a finite number")
    plain: float = found
    return plain


def _is_finite(value: float) -> bool:
    """Return True for a finite number within the range of float."""
    try:
        return math.isfinite(value)
    except OverflowError:
        return False


def numbers(name: str, values: Any) -> tuple[float, ...]:
    """Return finite numbers from a number, a list or an array."""
    if isinstance(values, list | tuple):
        return tuple([number(name, value) for value in values])
    found = _array(name, values)
    if found.ndim > 1:
        raise WrongQuestion(f"{name} has {found.ndim} axes, expected one")
    return (number(name, found.item()),) if found.ndim == 0 else tuple(_finite(name, found))


def column(name: str, values: Any) -> Any:
    """Return a number, or a list with one per character; a string is returned unchanged."""
    if isinstance(values, str):
        return values
    found = _array(name, values)
    return number(name, found.item()) if found.ndim == 0 else _finite(name, found)


def columns(**given: Any) -> dict[str, Any]:
    """Return the arguments that are not None, each as `column` returns it."""
    return {name: column(name, values) for name, values in given.items() if values is not None}


def _array(name: str, values: Any) -> npt.NDArray[Any]:
    try:
        return np.asarray(values)
    except ValueError:
        raise WrongQuestion(f"{name} holds lists of several lengths") from None


def _finite(name: str, found: npt.NDArray[Any]) -> list[Any]:
    if found.dtype.kind not in "fiu" or not np.isfinite(found).all():
        raise WrongQuestion(f"{name} holds what is no finite number")
    listed: list[Any] = found.tolist()
    return listed


def about(model: str, question: Struct) -> str:
    """Return a model and a question as the arguments of a call, for people; long lists are cut."""
    said = {key: getattr(question, key) for key in question.__struct_fields__}
    said = {**said.pop("controls", {}), **said}
    words = (f"{key}={_short(value)}" for key, value in said.items() if value is not UNSET)
    return ", ".join([repr(model), *words])


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"<{len(value)} items>"


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return the text " (did you mean 'NAME'?)" to follow an unknown name, or "" for no name."""
    near = get_close_matches(name[:LONGEST_NAME].lower(), known, n=1, cutoff=0.7)
    return f" (did you mean {near[0]!r}?)" if near else ""


def controls(given: Mapping[str, Any] | None, named: Mapping[str, Any]) -> dict[str, float]:
    """Return controls given by keyword, by a mapping, or both; WrongQuestion for duplicates."""
    return {name: number(name, value) for name, value in together(given, named).items()}


def together(given: Mapping[str, Any] | None, named: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return both mappings as one; WrongQuestion if they share a name."""
    if not given:
        return named
    if twice := sorted(given.keys() & named.keys()):
        raise WrongQuestion(f"given twice: {', '.join(twice)}")
    return {**given, **named}


def said(**words: Any) -> dict[str, Any]:
    """Return the arguments that are not None, as JSON values."""
    return {name: sayable(name, value) for name, value in words.items() if value is not None}


def sayable(name: str, value: Any) -> Any:
    """Return a value as JSON types, recursively; WrongQuestion if that is impossible."""
    if isinstance(value, Struct):
        value = _fields(value)
    found = value.tolist() if isinstance(value, np.generic | np.ndarray) else value
    if isinstance(found, Mapping):
        return {key: sayable(key, each) for key, each in found.items() if each is not UNSET}
    if isinstance(found, list | tuple):
        return [sayable(name, each) for each in found]
    if isinstance(found, bool | str | None):
        return found
    # JSON would encode a non-finite number as null, which has another meaning.
    return number(name, found)


def _fields(value: Struct) -> dict[str, Any]:
    """Return the fields of a struct, and what tells it from other structs of a union."""
    fields = {key: getattr(value, key) for key in value.__struct_fields__}
    config = value.__struct_config__
    return fields if config.tag is None else {str(config.tag_field): config.tag, **fields}
