"""Errors of a recipe: each mistake with its line and its key."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from posefield.common.errors import RecipeError
from posefield.common.name_suggestion import did_you_mean
from posefield_train.source.control_sources import COLUMN_TAG, MEASURED

Key = tuple[str | int, ...]
"""Path of a value: names of tables and keys, and indices of arrays."""
NAME = r"""(?:[\w-]+|"[^"\n]*"|'[^'\n]*')"""
# Strings of several lines, which may hold lines like keys; headers of tables; and keys.
STATEMENT = re.compile(
    r'"""(?:\\.|[^\\])*?"""|\'\'\'.*?\'\'\'|'
    rf"^[ \t]*(?P<brackets>\[{{0,2}})[ \t]*(?P<names>{NAME}(?:[ \t]*\.[ \t]*{NAME})*)[ \t]*[]=]",
    re.MULTILINE | re.DOTALL,
)
SHOWN = 200
"""Characters of a value in a message."""
MAX_LISTED = 20
"""Mistakes that are listed; a recipe with more was not meant as one."""


def recipe_error(
    path: Path, text: str, form: type[BaseModel], fault: ValidationError
) -> RecipeError:
    """Return the error of all mistakes in the text of a recipe, one on each line.

    form: type of the recipe. A missing key has the line of its table, or the first.
    """
    lines = {(): 1} | key_lines(text)
    listed = [
        _mistake(form, error)
        for error in fault.errors(include_url=False)
        # It only follows from another error.
        if error["type"] != "default_factory_not_called"
    ]
    errors = [
        RecipeError(
            path,
            message,
            next(lines[key[:end]] for end in range(len(key), -1, -1) if key[:end] in lines),
        )
        for key, message in listed[:MAX_LISTED]
    ]
    first, *others = errors
    if len(listed) > MAX_LISTED:
        others.append(RecipeError(path, f"{len(listed) - MAX_LISTED} further mistakes"))
    return RecipeError(path, "\n".join([first.message, *map(str, others)]), first.line)


def key_lines(text: str) -> dict[Key, int]:
    """Return the line, from 1, of each table and key of a valid TOML text that begins a line."""
    lines: dict[Key, int] = {}
    lengths: dict[Key, int] = {}
    table: Key = ()
    for match in STATEMENT.finditer(text):
        if match["names"] is None:
            continue
        names = [name.strip("\"'") for name in re.findall(NAME, match["names"])]
        path: Key = () if match["brackets"] else table
        for number, name in enumerate(names, 1):
            path += (name,)
            if match["brackets"] == "[[" and number == len(names):
                lengths[path] = lengths.get(path, 0) + 1
            if path in lengths:
                path += (lengths[path] - 1,)
            lines.setdefault(path, text.count("\n", 0, match.start("names")) + 1)
        table = path if match["brackets"] else table
    return lines


def _mistake(form: type[BaseModel], error: ErrorDetails) -> tuple[Key, str]:
    """Return the key of a mistake and the message about it."""
    key: Key = tuple(part for part in error["loc"] if part not in (COLUMN_TAG, MEASURED))
    message, found = error["msg"], ""
    match error["type"]:
        case "value_error":
            own = error["ctx"]["error"]
            key, message = key + getattr(own, "keys", ()), str(own)
        case "missing":
            pass
        case "extra_forbidden":
            known = _known_keys(form, error["loc"][:-1])
            hint = did_you_mean(str(key[-1]), known)
            found = f"{hint}{_quote_input(error['input'])}; expected some of {', '.join(known)}"
        case _:
            found = _quote_input(error["input"])
    return key, f"{'.'.join(map(str, key)) or 'recipe'}: {message}{found}"


def _quote_input(given: Any) -> str:
    """Return the given value for a message, cut to SHOWN characters."""
    shown = repr(given)
    return f", found {shown if len(shown) <= SHOWN else f'{shown[:SHOWN]}...'}"


def _known_keys(form: type[BaseModel], loc: Sequence[str | int]) -> list[str]:
    """Return the keys that a table accepts, by the location of an error."""
    kinds = [form]
    for part in loc:
        if part in (COLUMN_TAG, MEASURED):
            wanted = "column" if part == COLUMN_TAG else "auto"
            kinds = [kind for kind in kinds if wanted in kind.model_fields]
        elif isinstance(part, str):
            # A name that is no field is a key of a table with free keys.
            fields = [kind.model_fields[part] for kind in kinds if part in kind.model_fields]
            kinds = [each for one in fields for each in _models(one.annotation)] or kinds
    return [field.alias or name for kind in kinds for name, field in kind.model_fields.items()]


def _models(annotation: Any) -> list[type[BaseModel]]:
    """Return the models that an annotation mentions."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [each for part in get_args(annotation) for each in _models(part)]
