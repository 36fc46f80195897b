"""Requests made of what is asked: by GET where a cache can keep the answer, by POST where that
would be too long a line."""

import math
import re
from collections.abc import Iterable, Mapping
from decimal import Decimal
from typing import Any
from urllib.parse import quote_plus

import msgspec
import numpy as np
import numpy.typing as npt
from msgspec import UNSET, Struct

from posefield_client.errors import WrongQuestion
from posefield_client.generated import OPERATIONS, Target
from posefield_client.wire import Request

MODEL_NAME = re.compile(r"[a-z0-9][a-z0-9_-]{0,63}(@[0-9a-f]{16})?", re.ASCII)
LONGEST = 4000
"""Characters of path and query asked by GET; services take 8,192, unless told otherwise."""
_SAID_OTHERWISE = {"times": "time"}


def plain(operation: str, model: str, words: Mapping[str, Any] | None = None) -> Request:
    """Request by GET."""
    return Request(OPERATIONS[operation], _target(operation, model, words or {}))


def body(operation: str, model: str, question: Struct) -> Request:
    """Request by POST."""
    content = msgspec.json.encode(sayable(operation, question))
    return Request(OPERATIONS[operation], _target(operation, model, {}), content)


def either(noun: str, model: str, question: Struct) -> Request:
    """Request of get<noun>, or of query<noun> where the line would be too long."""
    asked = plain(f"get{noun}", model, _words(question))
    return asked if len(asked.target) <= LONGEST else body(f"query{noun}", model, question)


def _words(question: Struct) -> dict[str, Any]:
    """A question as the parameters of a query: each control is one."""
    words: dict[str, Any] = {}
    for key in question.__struct_fields__:
        value = getattr(question, key)
        if key == "controls":
            words.update(value)
        elif key == "exact" and isinstance(value, tuple):
            words[key] = ",".join(value)
        elif key == "targets" and value is not UNSET:
            words["target"] = tuple(map(_spelt, value))
        elif value is not UNSET:
            words[_SAID_OTHERWISE.get(key, key)] = value
    return words


def _spelt(target: Target) -> str:
    """A target in words."""
    moment = target.at if target.time is UNSET else digits(target.time)
    return f"{target.joint}@{moment}:{','.join(map(digits, target.position))}"


def _target(operation: str, model: str, words: Mapping[str, Any]) -> str:
    path = OPERATIONS[operation].path.replace("{model}", model)
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
    """A number without an exponent, whose + a query takes for a space."""
    text = repr(value)
    return format(Decimal(text), "f") if "e" in text else text


def model_name(name: str) -> str:
    """The name, if one can be asked for it."""
    if MODEL_NAME.fullmatch(name) is None:
        raise WrongQuestion(f"model {name!r}, expected a name or name@hash")
    return name


def number(name: str, value: Any) -> float:
    """A finite number as Python's own, a whole one whole; NumPy's are taken too."""
    found = value.item() if isinstance(value, np.generic) else value
    if type(found) not in (int, float) or not _is_finite(found):
        raise WrongQuestion(f"{name} is {value!r}, expected a finite number")
    plain: float = found
    return plain


def _is_finite(value: float) -> bool:
    """Whether a number is finite, and within what floating point holds."""
    try:
        return math.isfinite(value)
    except OverflowError:
        return False


def numbers(name: str, values: Any) -> tuple[float, ...]:
    """Finite numbers of one, of a list or of an array."""
    if isinstance(values, list | tuple):
        return tuple([number(name, value) for value in values])
    found = _array(name, values)
    if found.ndim > 1:
        raise WrongQuestion(f"{name} has {found.ndim} axes, expected one")
    return (number(name, found.item()),) if found.ndim == 0 else tuple(_finite(name, found))


def column(name: str, values: Any) -> Any:
    """A number, or one for each character; a word stays as it is."""
    if isinstance(values, str):
        return values
    found = _array(name, values)
    return number(name, found.item()) if found.ndim == 0 else _finite(name, found)


def columns(**given: Any) -> dict[str, Any]:
    """Those that are said, each as column."""
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


def controls(given: Mapping[str, Any] | None, named: Mapping[str, Any]) -> dict[str, float]:
    """Controls by keyword, by a mapping, or both; WrongQuestion where one is given twice."""
    return {name: number(name, value) for name, value in together(given, named).items()}


def together(given: Mapping[str, Any] | None, named: Mapping[str, Any]) -> Mapping[str, Any]:
    """Both mappings as one; WrongQuestion where they share a name."""
    if not given:
        return named
    if twice := sorted(given.keys() & named.keys()):
        raise WrongQuestion(f"given twice: {', '.join(twice)}")
    return {**given, **named}


def said(**words: Any) -> dict[str, Any]:
    """Those that are said: not None. NumPy's become Python's own; numbers are finite."""
    return {name: sayable(name, value) for name, value in words.items() if value is not None}


def sayable(name: str, value: Any) -> Any:
    """A value of Python's own, and all in it, as JSON can say it; WrongQuestion where none does."""
    if isinstance(value, Struct):
        value = {key: getattr(value, key) for key in value.__struct_fields__}
    found = value.tolist() if isinstance(value, np.generic | np.ndarray) else value
    if isinstance(found, Mapping):
        return {key: sayable(key, each) for key, each in found.items() if each is not UNSET}
    if isinstance(found, list | tuple):
        return [sayable(name, each) for each in found]
    if isinstance(found, bool | str | None):
        return found
    # What is not finite would be null, which means something else.
    return number(name, found)
