"""Errors of a recipe: each mistake with its line and its key."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from posefield.common.errors import RecipeError
from posefield.common.name_suggestion import did_you_mean
from posefield_train.source.control_sources import COLUMN_TAG, MEASURED

Key = tuple[str | int, ...]
"""Path of a value: names of tables and keys, and indices of arrays."""
Position = tuple[int, int]
"""Line and column, from 1."""

# Multi-line strings first, because they begin with the quotes of the others.
TOKEN = re.compile(
    r'(?P<string>"""(?:\\.|[^\\])*?"{3,5}|\'\'\'.*?\'{3,5}|"(?:\\.|[^"\\\n])*"|\'[^\'\n]*\')'
    r"|(?P<mark>[][{}=,\n])|(?P<bare>[^][{}=,\s#\"']+)|(?P<comment>#[^\n]*)",
    re.DOTALL,
)


@dataclass(frozen=True)
class Token:
    """A token of the text: its kind, its text, and its offset."""

    kind: str
    text: str
    offset: int


@dataclass
class PositionReader:
    """Offsets of the keys read so far. lengths: number of tables in each array of tables."""

    tokens: Sequence[Token]
    at: int = 0
    offsets: dict[Key, int] = field(default_factory=dict)
    lengths: dict[Key, int] = field(default_factory=dict)

    def read(self) -> None:
        """Read all statements."""
        table: Key = ()
        while self.at < len(self.tokens):
            if self.skip("\n"):
                continue
            if self.peek() == "[":
                table = self.header()
            else:
                self.pair(table)

    def header(self) -> Key:
        """Read the header of a table, or of one table of an array; return its path."""
        self.skip("[")
        repeated = self.skip("[")
        offset, names = self.key("]")
        self.skip("]")
        if repeated:
            self.skip("]")
        path = self.resolved(names[:-1]) + names[-1:]
        if repeated:
            self.lengths[path] = self.lengths.get(path, 0) + 1
        path = self.resolved(names)
        self.offsets.setdefault(path, offset)
        return path

    def resolved(self, names: Sequence[str]) -> Key:
        """Return the path of names from the top, with the last index of each array of tables."""
        path: Key = ()
        for name in names:
            path += (name,)
            if path in self.lengths:
                path += (self.lengths[path] - 1,)
        return path

    def pair(self, table: Key) -> None:
        """Read a key and its value."""
        offset, names = self.key("=")
        self.skip("=")
        path = table
        for name in names:
            path += (name,)
            self.offsets.setdefault(path, offset)
        self.value(path)

    def key(self, end: str) -> tuple[int, tuple[str, ...]]:
        """Return the offset of a key and its parts, which end before the mark `end`."""
        offset, parts = self.tokens[self.at].offset, list[str]()
        while self.at < len(self.tokens) and self.peek() != end:
            token = self.tokens[self.at]
            quoted = token.kind == "string"
            parts += [token.text[1:-1]] if quoted else filter(None, token.text.split("."))
            self.at += 1
        return offset, tuple(parts)

    def value(self, path: Key) -> None:
        """Read a value: words, an array or an inline table."""
        if self.skip("["):
            self.array(path)
        elif self.skip("{"):
            while not self.skip("}") and self.at < len(self.tokens):
                if not (self.skip(",") or self.skip("\n")):
                    self.pair(path)
        else:
            while self.at < len(self.tokens) and self.tokens[self.at].kind != "mark":
                self.at += 1

    def array(self, path: Key) -> None:
        """Read the values of an array up to its bracket."""
        count = 0
        while not self.skip("]") and self.at < len(self.tokens):
            if self.skip(",") or self.skip("\n"):
                continue
            self.offsets[(*path, count)] = self.tokens[self.at].offset
            self.value((*path, count))
            count += 1

    def peek(self) -> str:
        """Return the text of the next token."""
        return self.tokens[self.at].text

    def skip(self, mark: str) -> bool:
        """Advance past a mark if it is the next token; return whether it was."""
        if self.at < len(self.tokens) and self.tokens[self.at] == Token(
            "mark", mark, self.tokens[self.at].offset
        ):
            self.at += 1
            return True
        return False


def _tokens(text: str) -> Iterator[Token]:
    for match in TOKEN.finditer(text):
        kind = match.lastgroup or ""
        if kind != "comment":
            yield Token(kind, match.group(), match.start())


def key_positions(text: str) -> dict[Key, Position]:
    """Return the position of each table, key and array element of a valid TOML text."""
    reader = PositionReader(list(_tokens(text)))
    reader.read()
    return {path: _position(text, offset) for path, offset in reader.offsets.items()}


def _position(text: str, offset: int) -> Position:
    begin = text.rfind("\n", 0, offset) + 1
    return text.count("\n", 0, offset) + 1, offset - begin + 1


def nearest_position(positions: dict[Key, Position], path: Key) -> Position | None:
    """Return the position of a path, or of the innermost part of it that the text has."""
    for end in range(len(path), 0, -1):
        if path[:end] in positions:
            return positions[path[:end]]
    return None


SHOWN = 200
"""Characters of a value in a message."""
TOP = (1, 1)
"""Position of a missing key that belongs into no table."""
MAX_LISTED = 20
"""Mistakes that are listed; a recipe with more was not meant as one."""


def recipe_error(
    path: Path, text: str, form: type[BaseModel], fault: ValidationError
) -> RecipeError:
    """Return the error of all mistakes in the text of a recipe, one on each line.

    form: type of the recipe. A missing key has the position of its table.
    """
    positions = key_positions(text)
    listed = [_mistake(form, error) for error in fault.errors(include_url=False) if _own(error)]
    errors = [
        RecipeError(path, message, *(nearest_position(positions, key) or TOP))
        for key, message in listed[:MAX_LISTED]
    ]
    first, *others = errors
    if len(listed) > MAX_LISTED:
        others.append(RecipeError(path, f"{len(listed) - MAX_LISTED} further mistakes"))
    message = "\n".join([first.message, *map(str, others)])
    return RecipeError(path, message, first.line, first.column)


def _own(error: ErrorDetails) -> bool:
    """Return False for an error that only follows from another."""
    return error["type"] != "default_factory_not_called"


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
