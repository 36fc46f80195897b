"""Lines and columns of the keys of a TOML text that `tomllib` accepts, which tells none."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

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
