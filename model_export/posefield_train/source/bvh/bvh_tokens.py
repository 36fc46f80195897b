"""Tokens of the HIERARCHY section: words and braces with line numbers."""

import re

from posefield.common.errors import BvhError
from posefield.motion.bvh_writer import WORD
from posefield_train.source.bvh.bvh_content import MAX_NUMBER, NUMBER, Vector, quote

# Consecutive blank lines are one token, because a file can have millions.
TOKEN = re.compile(rf"\n\s*|[{{}}]|{WORD.pattern}", re.ASCII)


class TokenCursor:
    """Cursor over the tokens of `text`; `end` names the text after the last one.

    line: line of the token last taken. Tokens are found one at a time, so that an invalid file is
    refused early.
    """

    def __init__(self, text: str, source: str, end: str) -> None:
        self.source, self.end, self.line = source, end, 1
        self._matches = TOKEN.finditer(text)
        self._ahead_line = 1
        self._ahead = self._find()

    def _find(self) -> str:
        match = next(self._matches, None)
        return match.group() if match else ""

    def _advance(self) -> None:
        self._ahead_line += self._ahead.count("\n")
        self._ahead = self._find()

    def peek(self) -> str:
        """Return the next word or brace, empty at the end."""
        while self._ahead.startswith("\n"):
            self._advance()
        return self._ahead

    def take(self) -> str:
        """Return the next word or brace, empty at the end, and advance past it."""
        word = self.peek()
        self.line = self._ahead_line
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
        word = self.take()
        if word.upper() != keyword.upper():
            raise self.unexpected(word, keyword)

    def take_offset(self) -> Vector:
        """Return three numbers."""
        return self._number("X"), self._number("Y"), self._number("Z")

    def _number(self, axis: str) -> float:
        word = self.take()
        if not NUMBER.fullmatch(word):
            raise self.unexpected(word, f"a number, the {axis} of an OFFSET of three")
        if abs(value := float(word)) > MAX_NUMBER:
            raise self.unexpected(word, f"an OFFSET of at most {MAX_NUMBER:g}")
        return value

    def unexpected(self, word: str, expected: str) -> BvhError:
        """Return an error about the token last taken."""
        return self.error(f"found {quote(word) if word else self.end}, expected {expected}")

    def error(self, message: str) -> BvhError:
        """Return an error at the line of the token last taken."""
        return BvhError(self.source, message, self.line)
