"""Log of requests: JSON lines on standard error, with the trace that a request belongs to.

Lines are buffered briefly and written together: a system call per line would take a tenth of a pose
request's time.
"""

import asyncio
import os
import re
from collections.abc import Mapping
from datetime import UTC, datetime
from functools import lru_cache
from typing import Any

import orjson

FLUSH_DELAY = 0.05
"""Maximum time of a line in the buffer, s."""

WRITE_SIZE = 4096
"""Bytes that a pipe accepts atomically, so that lines of several processes do not interleave."""


class LogBuffer:
    """Buffer of log lines for a file descriptor."""

    def __init__(self, target: int) -> None:
        self._target = target
        self._buffer: list[bytes] = []

    def add(self, content: Mapping[str, Any]) -> None:
        """Buffer a line of JSON; a flush follows within FLUSH_DELAY. Needs a running event loop."""
        if not self._buffer:
            asyncio.get_running_loop().call_later(FLUSH_DELAY, self.flush)
        self._buffer.append(orjson.dumps(content, option=orjson.OPT_APPEND_NEWLINE))

    def flush(self) -> None:
        """Write the buffer."""
        lines, self._buffer = self._buffer, []
        for piece in _pieces(lines):
            while piece:
                piece = piece[os.write(self._target, piece) :]


def _pieces(lines: list[bytes]) -> list[bytes]:
    """Return the lines joined to pieces of at most WRITE_SIZE bytes; a longer line is a piece."""
    pieces, size = [[]], 0  # type: list[list[bytes]], int
    for line in lines:
        if size + len(line) > WRITE_SIZE and pieces[-1]:
            pieces.append([])
            size = 0
        pieces[-1].append(line)
        size += len(line)
    return [b"".join(piece) for piece in pieces if piece]


def timestamp(seconds: float) -> str:
    """Return a time in RFC 3339 form, UTC.

    seconds: since 1970.
    """
    second = int(seconds)
    return f"{_whole_second(second)}.{int(1000 * (seconds - second)):03d}Z"


@lru_cache(1)
def _whole_second(second: int) -> str:
    return datetime.fromtimestamp(second, UTC).strftime("%Y-%m-%dT%H:%M:%S")


# Header traceparent of the W3C Trace Context, version 00.
_PARENT = re.compile(rb"00-([0-9a-f]{32})-[0-9a-f]{16}-[0-9a-f]{2}")


def trace_id(headers: Mapping[bytes, bytes]) -> str | None:
    """Return the trace id in a request's headers; None without a valid one."""
    parent = _PARENT.fullmatch(headers.get(b"traceparent", b""))
    return parent[1].decode() if parent else None
