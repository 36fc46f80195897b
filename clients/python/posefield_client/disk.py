"""Answers kept in a folder, which several processes may share."""

import os
import re
import secrets
import time
import warnings
from contextlib import suppress
from hashlib import blake2b
from pathlib import Path

import msgspec

from posefield_client.cache import Kept

DIGEST = 16
NAME = re.compile(r"[0-9a-f]{40}(\.[0-9a-f]{12}\.part)?")
"""What our files are called, as cache.name does: the folder may hold others."""
FORGOTTEN = 3600.0
"""Seconds after which what a process left half-written is taken away."""


class Disk:
    """The answers used last, up to some bytes, one file each.

    A file is written beside and renamed, and begins with the digest of the rest: whatever else is
    found there is none. Each process looks at the folder's size after it has written a sixteenth of
    the limit; meanwhile it may be passed by as much.
    """

    def __init__(self, folder: Path, limit: int = 2**30) -> None:
        self.folder = folder
        self.limit = limit
        self.largest = limit // 16
        self._written = limit
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)

    def find(self, name: str) -> Kept | None:
        """The answer of that name."""
        path = self.folder / name
        try:
            found = _read(path.read_bytes())
        except (OSError, ValueError):
            return None
        # What is used last is let go last, as far as the folder may be written.
        with suppress(OSError):
            os.utime(path)
        return found

    def keep(self, name: str, kept: Kept) -> None:
        """Keep an answer; where the folder cannot be written, warn and go on without."""
        content = msgspec.msgpack.encode((kept.headers, kept.content, kept.until))
        try:
            self._write(name, content)
            self._written += len(content)
            if self._written > self.limit // 16:
                self._written = 0
                self._tidy()
        except OSError as fault:
            warnings.warn(f"answers cannot be kept in {self.folder}: {fault}", stacklevel=2)

    def _write(self, name: str, content: bytes) -> None:
        part = self.folder / f"{name}.{secrets.token_hex(6)}.part"
        try:
            with os.fdopen(
                os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb"
            ) as file:
                file.write(_digest(content))
                file.write(content)
            part.replace(self.folder / name)
        except OSError:
            part.unlink(missing_ok=True)
            raise

    def _tidy(self) -> None:
        """Take away what was not used for longest, down to seven eighths of the limit."""
        ours = (path for path in self.folder.iterdir() if NAME.fullmatch(path.name))
        found = sorted(filter(None, map(_looked_at, ours)), reverse=True)
        size = 0
        for used, length, path in found:
            if path.suffix == ".part":
                # Somebody may be writing it just now.
                needless = used < time.time() - FORGOTTEN
            else:
                size += length
                needless = size > self.limit * 7 // 8
            if needless:
                # Another process may have been faster.
                with suppress(OSError):
                    path.unlink()


def _looked_at(path: Path) -> tuple[float, int, Path] | None:
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_mtime, found.st_size, path


def _digest(content: bytes) -> bytes:
    return blake2b(content, digest_size=DIGEST).digest()


_KEPT = msgspec.msgpack.Decoder(tuple[dict[str, str], bytes, float])


def _read(content: bytes) -> Kept:
    """ValueError where these are not the bytes that were written."""
    if content[:DIGEST] != _digest(content[DIGEST:]):
        raise ValueError("no answer, or a torn one")
    return Kept(*_KEPT.decode(content[DIGEST:]))
