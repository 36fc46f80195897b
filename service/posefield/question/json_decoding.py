"""Decoding of queries from JSON bodies with msgspec; its errors are converted to FormError."""

import codecs
import itertools
import json
import sys
from collections.abc import Callable, Sequence
from functools import cache
from types import UnionType
from typing import Any, TypeVar, Union, cast, get_args, get_origin, get_type_hints

import msgspec

from posefield.common.errors import FormError, did_you_mean

Question = TypeVar("Question")
_PATH = " - at `$"
_FIELD = "Object contains unknown field `", "Object missing required field `"
MAX_PLAIN_BYTES = 1 << 20
"""Bytes of the largest body that is decoded again to Python objects, twenty times its size."""
_ANY_KEY = "..."
"""Placeholder of msgspec's messages for the key of a mapping."""


def decode_question(form: type[Question], content: bytes) -> Question:
    """Return the query of a JSON body.

    A byte order mark, as of Windows editors, is left out. Raises FormError for an invalid body, and
    the errors of the query's own checks.
    """
    content = content.removeprefix(codecs.BOM_UTF8)
    try:
        question: Question = _decoder(cast(Any, form)).decode(content)
        return question
    except msgspec.ValidationError as fault:
        return _decode_plain(form, content, fault)
    except (msgspec.DecodeError, UnicodeDecodeError) as fault:
        raise FormError("", f"expected UTF-8 JSON; {fault}") from None
    except RecursionError:
        raise FormError("", "nested too deeply") from None


@cache
def _decoder(form: Any) -> msgspec.json.Decoder[Any]:
    return msgspec.json.Decoder(form)


def _decode_plain(form: type[Question], content: bytes, fault: msgspec.ValidationError) -> Question:
    """Return the query of a rejected body with whole floats as integers: in JSON 1.0 equals 1.

    Raises FormError if it is still invalid.
    """
    if len(content) > MAX_PLAIN_BYTES:
        raise _form_error(form, str(fault), None) from None
    try:
        plain, message = json.loads(content.decode()), str(fault)
    except (RecursionError, ValueError):
        # msgspec reports a wrong type before it parses the rest, which may be invalid JSON.
        raise _form_error(form, str(fault), None) from None
    if "out of range" not in message:
        return convert_question(form, plain)
    raise _form_error(form, message, plain) from None


def convert_question(form: type[Question], plain: Any) -> Question:
    """Return the query of a body's plain value, in which 1.0 equals 1.

    Raises FormError as `decode_question` does.
    """
    try:
        return msgspec.convert(_with_whole_numbers(plain), form)
    except msgspec.ValidationError as fault:
        raise _form_error(form, str(fault), plain) from None


def _form_error(form: Any, text: str, plain: Any) -> FormError:
    """Return the error of msgspec's message about a body of a type; plain: its value, if known."""
    path, value = list(itertools.takewhile(_ANY_KEY.__ne__, error_path(text))), dict[str, Any]()
    if plain is not None:
        path, value = _resolve_path(error_path(text), plain)
    message = text.rpartition(_PATH)[0] or text
    typed = text.startswith("Expected") and not isinstance(value, dict | list)
    detail = f" {value!r}"[:100] if typed else _accepted_names(form, path, plain, value)
    return FormError(json_pointer(*path).removeprefix("/"), message + detail)


def _accepted_names(form: Any, path: Sequence[str], plain: Any, value: Any) -> str:
    """Return the names that a type accepts at the path of an error, to follow its message.

    They are the keys of the object whose unknown key ends the path, or the choices of a text. Empty
    if the path leads to neither.
    """
    keys = getattr(_type_at(form, path[:-1], plain), "__struct_encode_fields__", ())
    if path and keys and path[-1] not in keys:
        return f"{did_you_mean(path[-1], keys)}, expected some of {', '.join(keys)}"
    choices = get_args(_type_at(form, path, plain)) or _tags(form, path, plain)
    if isinstance(value, str) and choices and all(isinstance(choice, str) for choice in choices):
        return f"{did_you_mean(value, choices)}, expected one of {', '.join(choices)}"
    return ""


def _type_at(form: Any, path: Sequence[str], plain: Any) -> Any:
    """Return the type at a path in a value of a type; None if it is not known.

    plain: the value, whose tags tell which member of a union it has.
    """
    kind = _without_absence(form)
    for step in path:
        if hasattr(kind, "__struct_fields__"):
            kind = get_type_hints(kind).get(step)
        elif get_origin(kind) in (list, tuple):
            kind = get_args(kind)[0]
        else:
            kind = None
        plain = _member(plain, step)
        kind = _tagged(_without_absence(kind), plain)
    return kind


def _member(plain: Any, step: str) -> Any:
    """Return a member of a plain value; None if it has none of that name."""
    if isinstance(plain, dict):
        return plain.get(step)
    present = isinstance(plain, list) and step.isdigit() and int(step) < len(plain)
    return plain[int(step)] if present else None


def _tagged(kind: Any, plain: Any) -> Any:
    """Return the member of a union of tagged structs that a plain value has; others unchanged."""
    for member in get_args(kind):
        config = getattr(member, "__struct_config__", None)
        if config and isinstance(plain, dict) and plain.get(config.tag_field) == config.tag:
            return member
    return kind


def _tags(form: Any, path: Sequence[str], plain: Any) -> tuple[str, ...]:
    """Return the tags of the union at a path that ends with the name of its tag."""
    members = get_args(_type_at(form, path[:-1], plain)) if path else ()
    configs = [getattr(member, "__struct_config__", None) for member in members]
    return tuple(config.tag for config in configs if config and config.tag_field == path[-1])


def _without_absence(kind: Any) -> Any:
    """Return the only member of a union besides None and UNSET; other types unchanged."""
    if get_origin(kind) not in (Union, UnionType):
        return kind
    members = [member for member in get_args(kind) if member not in (type(None), msgspec.UnsetType)]
    if len(members) != 1 and not all(hasattr(member, "__struct_fields__") for member in members):
        return None
    return members[0] if len(members) == 1 else kind


def _with_whole_numbers(node: Any) -> Any:
    if isinstance(node, dict):
        return {key: _with_whole_numbers(value) for key, value in node.items()}
    if isinstance(node, list):
        return [_with_whole_numbers(value) for value in node]
    return int(node) if isinstance(node, float) and node.is_integer() else node


def _resolve_path(path: list[str], node: Any) -> tuple[list[str], Any]:
    """Return the path with the invalid key for each placeholder, and the value at its end."""
    keys: list[str] = []
    for step in path:
        if step == _ANY_KEY and isinstance(node, dict):
            step = _key_at_fault(node, _is_label if keys[-1:] == ["labels"] else _is_numeric)
        keys.append(step)
        if isinstance(node, list):
            node = node[int(step)]
        else:
            node = node.get(step, {})
    return keys, node


def _key_at_fault(values: dict[str, Any], is_valid: Callable[[Any], bool]) -> str:
    """Return the first key with an invalid value, else the first whose value is a list."""
    wrong = (key for key, value in values.items() if not is_valid(value))
    lists = (key for key, value in values.items() if isinstance(value, list))
    return next(itertools.chain(wrong, lists))


def _is_label(value: Any) -> bool:
    """Return whether a value is a name, weights of names, or a list of them with gaps."""
    if isinstance(value, list):
        return all(name is None or isinstance(name, str | dict) for name in value)
    weights = isinstance(value, dict) and all(map(_is_numeric, value.values()))
    return isinstance(value, str) or weights


def _is_numeric(value: Any) -> bool:
    values = value if isinstance(value, list) else [value]
    return all(
        type(number) in (int, float) and abs(number) <= sys.float_info.max for number in values
    )


def json_pointer(*keys: str) -> str:
    """Return the JSON pointer of keys and indices, RFC 6901."""
    return "".join("/" + key.replace("~", "~0").replace("/", "~1") for key in keys)


def error_path(message: str) -> list[str]:
    """Return the keys and indices of the invalid value in a message of msgspec.

    The message repeats the client's input, so it is parsed from its two ends: "Object contains
    unknown field `NAME` - at `$.KEY[INDEX]`", where either part may be absent.
    """
    rest, keys = message, []
    if rest.endswith("`") and (start := rest.rfind(_PATH)) >= 0:
        path = rest[start + len(_PATH) : -1].replace("[...]", f"[{_ANY}]")
        keys = path.replace("[", ".").replace("]", "").split(".")[1:]
        keys = [_ANY_KEY if step == _ANY else step for step in keys]
        rest = rest[:start]
    for opening in _FIELD:
        if rest.startswith(opening) and rest.endswith("`"):
            keys.append(rest[len(opening) : -1])
    return keys


_ANY = "\0"
