"""Cache of responses in a folder that several processes can share."""

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
"""Names of the cache's files, from cache.name; the folder may hold other files."""
FORGOTTEN = 3600.0
"""Age after which an incomplete file is deleted, s."""


class Disk:
    """Least-recently-used cache with one file per response. limit: total size, bytes.

    A file is written under a temporary name and renamed, and starts with a digest of its content;
    invalid files are ignored. Each process evicts files after it has written a sixteenth of the
    limit, so each can exceed the limit by that much.
    """

    def __init__(self, folder: Path, limit: int = 2**30) -> None:
        self.folder = folder
        self.limit = limit
        self.largest = limit // 16
        self._written = limit
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)

    def find(self, name: str) -> Kept | None:
        """Return the response of a name; None if missing or invalid."""
        path = self.folder / name
        try:
            found = _read(path.read_bytes())
        except (OSError, ValueError):
            return None
        # Mark the file as recently used; the folder may be read-only.
        with suppress(OSError):
            os.utime(path)
        return found

    def keep(self, name: str, kept: Kept) -> None:
        """Store a response; warn if the folder cannot be written."""
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
        """Delete the least recently used responses, down to seven eighths of the limit."""
        ours = (path for path in self.folder.iterdir() if NAME.fullmatch(path.name))
        found = sorted(filter(None, map(_looked_at, ours)), reverse=True)
        size = 0
        for used, length, path in found:
            if path.suffix == ".part":
                # Another process may still be writing it.
                needless = used < time.time() - FORGOTTEN
            else:
                size += length
                needless = size > self.limit * 7 // 8
            if needless:
                # Another process may have deleted it.
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
    """Return a response from a file's content; ValueError if the digest does not match."""
    if content[:DIGEST] != _digest(content[DIGEST:]):
        raise ValueError("no answer, or a torn one")
    return Kept(*_KEPT.decode(content[DIGEST:]))
