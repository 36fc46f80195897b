"""Cache of responses, with freshness by max-age and revalidation by entity tag (RFC 9111)."""

import re
import threading
import time
from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass, replace
from hashlib import blake2b
from typing import Protocol

KEPT_HEADERS = ("content-type", "etag")
OWN_HEADERS = "posefield-"
_AGE = re.compile(r"\bmax-age=(\d+)\b", re.ASCII)


@dataclass(frozen=True, slots=True)
class Kept:
    """A cached response. until: Unix time until which it is fresh, s."""

    headers: dict[str, str]
    content: bytes
    until: float

    @property
    def holds(self) -> bool:
        """Return True if it is fresh."""
        return time.time() < self.until

    def renewed(self, headers: Mapping[str, str]) -> "Kept":
        """Return the response with the freshness of a revalidation's headers."""
        return replace(self, until=until(headers))


class Cache(Protocol):
    """Store of responses. largest: size limit of one response, bytes."""

    largest: int

    def find(self, name: str) -> Kept | None:
        """Return the response of a name; None if missing."""

    def keep(self, name: str, kept: Kept) -> None:
        """Store a response under a name."""


def scope(*parts: str) -> bytes:
    """Return a digest of the parts that responses depend on: contract, address, key."""
    return blake2b("\0".join(parts).encode(), digest_size=32).digest()


def name(of: bytes, target: str) -> str:
    """Return the cache key of a request target, from which key and request cannot be read."""
    return blake2b(target.encode(), key=of, digest_size=20).hexdigest()


def until(headers: Mapping[str, str]) -> float:
    """Return the Unix time until which a response is fresh, s; 0 for never."""
    said = headers.get("cache-control", "")
    age = _AGE.search(said)
    return time.time() + int(age[1]) if age and "no-cache" not in said else 0.0


def kept(headers: Mapping[str, str], content: bytes) -> Kept | None:
    """Return the response to store; None if it must not be stored."""
    if "no-store" in headers.get("cache-control", "no-store") or "etag" not in headers:
        return None
    told = {
        key: value
        for key, value in headers.items()
        if key in KEPT_HEADERS or key.startswith(OWN_HEADERS)
    }
    return Kept(told, content, until(headers))


class Memory:
    """Least-recently-used cache in memory. limit: total size, bytes."""

    def __init__(self, limit: int = 16 * 2**20) -> None:
        self.limit = limit
        self.largest = limit // 8
        self._size = 0
        self._answers: OrderedDict[str, Kept] = OrderedDict()
        self._lock = threading.Lock()

    def find(self, name: str) -> Kept | None:
        """Return the response of a name; None if missing."""
        with self._lock:
            found = self._answers.get(name)
            if found is not None:
                self._answers.move_to_end(name)
            return found

    def keep(self, name: str, kept: Kept) -> None:
        """Store a response, and evict the least recently used ones above the limit."""
        with self._lock:
            before = self._answers.pop(name, None)
            self._size += len(kept.content) - (len(before.content) if before else 0)
            self._answers[name] = kept
            while self._size > self.limit:
                self._size -= len(self._answers.popitem(last=False)[1].content)


NOTHING = Memory(0)
"""Cache without capacity."""
