"""Hierarchy of a BVH file: joints, their offsets and channels, and end sites."""

import re
from dataclasses import dataclass
from functools import lru_cache

from posefield.common.errors import BvhError
from posefield.motion.bvh_writer import WORD

CHANNELS = ("Xposition", "Yposition", "Zposition", "Xrotation", "Yrotation", "Zrotation")
CHANNEL_NAMES = {name.lower(): name for name in CHANNELS}
COUNT = re.compile(r"\d{1,3}", re.ASCII)
NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?", re.ASCII)
# Consecutive blank lines are one token, because a file can have millions.
TOKEN = re.compile(rf"\n\s*|[{{}}]|{WORD.pattern}", re.ASCII)

MAX_NUMBER = 1e9
"""Largest magnitude of a number; larger ones would overflow in products."""
MAX_JOINTS, MAX_DEPTH = 1000, 256
"""Limits of joints and levels, several times those of any character."""

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class BvhJoint:
    """One joint as written.

    parent: index of an earlier joint, -1 for the root. offset: in the file's unit. channels: in the
    order of their columns, spelled as in CHANNELS.
    """

    name: str
    parent: int
    offset: Vector
    channels: tuple[str, ...]


class _Tokens:
    """Cursor over the words and braces of `text`; `end` names the text after the last one.

    line: line of the token last taken. Tokens are found one at a time, so that an invalid file is
    refused early. Errors have no file, because the hierarchy is cached.
    """

    def __init__(self, text: str, end: str) -> None:
        self.end, self.line, self._ahead_line = end, 1, 1
        self._texts = (match.group() for match in TOKEN.finditer(text))
        self._ahead = next(self._texts, "")

    def _advance(self) -> None:
        self._ahead_line += self._ahead.count("\n")
        self._ahead = next(self._texts, "")

    def peek(self) -> str:
        """Return the next word or brace, empty at the end."""
        while self._ahead.startswith("\n"):
            self._advance()
        return self._ahead

    def take(self) -> str:
        """Return the next word or brace, empty at the end, and advance past it."""
        word, self.line = self.peek(), self._ahead_line
        self._advance()
        return word

    def take_name(self) -> str:
        """Return the words up to the line's end or a brace, joined by single blanks."""
        words = []
        while self._ahead not in ("", "{", "}") and not self._ahead.startswith("\n"):
            words.append(self.take())
        if not words:
            raise self.error("found no name, expected a joint's name on this line")
        return " ".join(words)

    def expect(self, keyword: str) -> None:
        """Advance past `keyword`, ignoring case; raise BvhError for another token."""
        if (word := self.take()).upper() != keyword.upper():
            raise self.unexpected(word, keyword)

    def take_offset(self) -> Vector:
        """Return three numbers."""
        numbers = []
        for axis in "XYZ":
            word = self.take()
            if not NUMBER.fullmatch(word):
                raise self.unexpected(word, f"a number, the {axis} of an OFFSET of three")
            if abs(value := float(word)) > MAX_NUMBER:
                raise self.unexpected(word, f"an OFFSET of at most {MAX_NUMBER:g}")
            numbers.append(value)
        x, y, z = numbers
        return x, y, z

    def take_channels(self) -> tuple[str, ...]:
        """Return the channels of a declared count and as many different names."""
        word = self.take()
        if not COUNT.fullmatch(word):
            raise self.unexpected(word, "the number of CHANNELS")
        line, declared, names = self.line, int(word), list[str]()
        while self.peek().lower() in CHANNEL_NAMES:
            name = CHANNEL_NAMES[self.take().lower()]
            if name in names:
                raise self.error(f"found channel {name} a second time in one joint, expected once")
            names.append(name)
        following = ("", "{", "}", "OFFSET", "CHANNELS", "JOINT", "END")
        if len(names) < declared and self.peek().upper() not in following:
            raise self.unexpected(self.take(), f"a channel, one of {', '.join(CHANNELS)}")
        if len(names) != declared:
            self.line = line
            raise self.error(f"found {len(names)} channel names, expected CHANNELS {declared}")
        return tuple(names)

    def unexpected(self, word: str, expected: str) -> BvhError:
        """Return an error about the token last taken."""
        return self.error(f"found {quote(word) if word else self.end}, expected {expected}")

    def error(self, message: str) -> BvhError:
        """Return an error at the line of the token last taken."""
        return BvhError("", message, self.line)


@dataclass
class _JointDraft:
    name: str
    parent: int
    line: int
    offset: Vector | None = None
    channels: tuple[str, ...] | None = None
    has_children: bool = False


# All recordings of one performer have the same hierarchy.
@lru_cache(maxsize=16)
def parse_hierarchy(
    head: str, end: str
) -> tuple[tuple[BvhJoint, ...], tuple[tuple[int, Vector], ...]]:
    """Return the joints and end sites of the text before MOTION; `end` names the text after it.

    It does not recurse, so that deep nesting cannot overflow the stack.
    """
    tokens = _Tokens(decode(head.encode("latin-1")), end)
    drafts: list[_JointDraft] = []
    open_joints: list[int] = []
    lines: dict[str, int] = {}
    tips: list[tuple[int, Vector]] = []
    tokens.expect("HIERARCHY")
    tokens.expect("ROOT")
    # The root begins as any joint does.
    word = "JOINT"
    while True:
        keyword = word.upper()
        if keyword == "JOINT":
            parent = open_joints[-1] if open_joints else -1
            joint = _JointDraft(tokens.take_name(), parent, tokens.line)
            if first := lines.get(joint.name):
                raise tokens.error(
                    f"joint name {quote(joint.name)} stands at line {first} and again at line "
                    f"{joint.line}, expected every joint to have its own name"
                )
            lines[joint.name] = joint.line
            if open_joints:
                drafts[parent].has_children = True
            open_joints.append(len(drafts))
            drafts.append(joint)
            if len(drafts) > MAX_JOINTS:
                raise tokens.error(f"found {len(drafts)} joints, expected at most {MAX_JOINTS}")
            if len(open_joints) > MAX_DEPTH:
                raise tokens.error(f"found {len(open_joints)} levels, expected at most {MAX_DEPTH}")
            tokens.expect("{")
        elif keyword in ("OFFSET", "CHANNELS"):
            name, is_offset = quote(joint.name), keyword == "OFFSET"
            if (joint.offset if is_offset else joint.channels) is not None:
                raise tokens.error(f"found a second {keyword} in joint {name}, expected one")
            if joint.has_children:
                # The order of the columns would be ambiguous.
                raise tokens.error(
                    f"found {keyword} of joint {name} after a child, expected it before"
                )
            if is_offset:
                joint.offset = tokens.take_offset()
            else:
                joint.channels = tokens.take_channels()
        elif keyword == "END":
            tokens.expect("Site")
            joint.has_children = True
            tokens.expect("{")
            tokens.expect("OFFSET")
            tips.append((open_joints[-1], tokens.take_offset()))
            tokens.expect("}")
        elif keyword == "}":
            open_joints.pop()
            if joint.offset is None:
                message = f"found the end of joint {quote(joint.name)} of line {joint.line}"
                raise tokens.error(f"{message}, expected its OFFSET first")
            if not open_joints:
                break
        else:
            expected = "OFFSET, CHANNELS, JOINT, End Site or '}' in joint "
            raise tokens.unexpected(word, f"{expected}{quote(joint.name)} of line {joint.line}")
        joint, word = drafts[open_joints[-1]], tokens.take()
    word = tokens.take()
    if word.upper() == "ROOT":
        raise tokens.error(f"one root expected, found a second at line {tokens.line}")
    if word or end != "MOTION":
        raise tokens.unexpected(word, "a line MOTION after the root's closing brace")
    joints = (
        BvhJoint(draft.name, draft.parent, draft.offset or (0.0, 0.0, 0.0), draft.channels or ())
        for draft in drafts
    )
    return tuple(joints), tuple(tips)


def decode(content: bytes) -> str:
    """Decode text as UTF-8, else as cp932 (Japanese tools), else as Latin-1, which never fails."""
    for encoding in ("utf-8-sig", "cp932"):
        try:
            return content.decode(encoding)
        except UnicodeDecodeError:
            continue
    return content.decode("latin-1")


def foreign_encoding(start: bytes) -> str:
    """Return the encoding or packing that the first bytes of a file tell; empty for plain text."""
    marks = {
        b"\xff\xfe": "text in UTF-16",
        b"\xfe\xff": "text in UTF-16",
        b"\x1f\x8b": "a file packed by gzip",
        b"PK\x03\x04": "a zip archive",
    }
    marked = next((name for mark, name in marks.items() if start.startswith(mark)), "")
    return marked or ("text in UTF-16" if start[:2].count(0) == 1 else "")


def quote(text: str) -> str:
    """Quote text for a message, cut to 40 characters."""
    return repr(text if len(text) <= 40 else f"{text[:37]}...")
