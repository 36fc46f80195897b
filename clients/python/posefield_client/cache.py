"""Answers kept: what may be used unasked, and what is asked for again by its entity tag."""

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
    """An answer at hand. until: moment (Unix time) up to which it may be used unasked."""

    headers: dict[str, str]
    content: bytes
    until: float

    @property
    def holds(self) -> bool:
        """Whether it may be used unasked."""
        return time.time() < self.until

    def renewed(self, headers: Mapping[str, str]) -> "Kept":
        """The same, which the service has just said to be still right."""
        return replace(self, until=until(headers))


class Cache(Protocol):
    """Where answers are kept. largest: bytes of the largest that is."""

    largest: int

    def find(self, name: str) -> Kept | None:
        """The answer of that name."""

    def keep(self, name: str, kept: Kept) -> None:
        """Keep an answer under a name."""


def scope(*parts: str) -> bytes:
    """Digest of all that makes the same question another one: contract, address, key."""
    return blake2b("\0".join(parts).encode(), digest_size=32).digest()


def name(of: bytes, target: str) -> str:
    """What an answer is called: a digest, from which neither key nor question can be read."""
    return blake2b(target.encode(), key=of, digest_size=20).hexdigest()


def until(headers: Mapping[str, str]) -> float:
    """Moment up to which an answer may be used unasked; 0: not at all."""
    said = headers.get("cache-control", "")
    age = _AGE.search(said)
    return time.time() + int(age[1]) if age and "no-cache" not in said else 0.0


def kept(headers: Mapping[str, str], content: bytes) -> Kept | None:
    """The answer as it is kept; None where it is not to be."""
    if "no-store" in headers.get("cache-control", "no-store") or "etag" not in headers:
        return None
    told = {
        key: value
        for key, value in headers.items()
        if key in KEPT_HEADERS or key.startswith(OWN_HEADERS)
    }
    return Kept(told, content, until(headers))


class Memory:
    """The answers used last, up to some bytes of content, for as long as the client lives."""

    def __init__(self, limit: int = 16 * 2**20) -> None:
        self.limit = limit
        self.largest = limit // 8
        self._size = 0
        self._answers: OrderedDict[str, Kept] = OrderedDict()
        self._lock = threading.Lock()

    def find(self, name: str) -> Kept | None:
        """The answer of that name."""
        with self._lock:
            found = self._answers.get(name)
            if found is not None:
                self._answers.move_to_end(name)
            return found

    def keep(self, name: str, kept: Kept) -> None:
        """Keep an answer, and let go of those that were not used for longest."""
        with self._lock:
            before = self._answers.pop(name, None)
            self._size += len(kept.content) - (len(before.content) if before else 0)
            self._answers[name] = kept
            while self._size > self.limit:
                self._size -= len(self._answers.popitem(last=False)[1].content)


NOTHING = Memory(0)
"""Keeps nothing."""
