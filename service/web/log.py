"""One JSON line for each request on standard error.

Lines are gathered for a moment and written together: a system call for each would cost a tenth of
what answering with a pose does.
"""

import asyncio
import os
import sys
from collections.abc import Mapping
from datetime import UTC, datetime
from functools import lru_cache
from typing import Any

import orjson

MOMENT = 0.05
"""Seconds that a line may wait."""

PIECE = 4096
"""Bytes that a pipe takes whole, so that lines of several processes do not mix."""


class Lines:
    """Lines on their way to a file descriptor."""

    def __init__(self, target: int) -> None:
        self._target = target
        self._held: list[bytes] = []

    def add(self, content: Mapping[str, Any]) -> None:
        """Write this soon, in an event loop."""
        if not self._held:
            asyncio.get_running_loop().call_later(MOMENT, self.flush)
        self._held.append(orjson.dumps(content, option=orjson.OPT_APPEND_NEWLINE))

    def flush(self) -> None:
        """Write what is held."""
        held, self._held = self._held, []
        for piece in _pieces(held):
            _write(self._target, piece)


def _write(target: int, piece: bytes) -> None:
    while piece:
        piece = piece[os.write(target, piece) :]


def _pieces(lines: list[bytes]) -> list[bytes]:
    """The lines joined to pieces that are written at once, a long line alone."""
    pieces, size = [[]], 0  # type: list[list[bytes]], int
    for line in lines:
        if size + len(line) > PIECE and pieces[-1]:
            pieces.append([])
            size = 0
        pieces[-1].append(line)
        size += len(line)
    return [b"".join(own) for own in pieces if own]


def to_standard_error() -> Lines:
    """Lines to where a container's log is read from."""
    return Lines(sys.stderr.fileno())


def moment(seconds: float) -> str:
    """Time of day of a clock's reading, UTC, as RFC 3339 writes it."""
    whole = int(seconds)
    return f"{_second(whole)}.{int(1000 * (seconds - whole)):03d}Z"


@lru_cache(1)
def _second(whole: int) -> str:
    return datetime.fromtimestamp(whole, UTC).strftime("%Y-%m-%dT%H:%M:%S")
