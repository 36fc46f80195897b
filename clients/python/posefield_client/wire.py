"""Requests and responses of httpx: addresses, headers, decoding, retries and the cache."""

import random
import re
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from importlib.metadata import version
from typing import Generic, Protocol, TypeVar

import httpx
import msgspec

from posefield_client import errors
from posefield_client.errors import (
    Broken,
    IncompleteAnswer,
    PosefieldError,
    TimedOut,
    Unexpected,
    Unreachable,
    WrongQuestion,
)
from posefield_client.generated import Operation

T = TypeVar("T")
AGENT = f"posefield-client/{version('posefield-client')}"
_MAX_AGE = re.compile(r"\bmax-age=(\d+)\b", re.ASCII)


@dataclass(frozen=True, slots=True)
class Reply:
    """An HTTP response. content: empty if it was written to a sink. until: Unix time, s."""

    status: int
    headers: Mapping[str, str]
    content: bytes
    until: float = 0.0

    def is_fresh(self) -> bool:
        """Return True for a cached response that needs no revalidation."""
        return time.time() < self.until


@dataclass(frozen=True, slots=True)
class Call(Generic[T]):
    """A request and the decoder of its response, which raises ValueError for an invalid one.

    target: path and query, relative to the service's address. body: None for GET.
    """

    operation: Operation
    target: str
    read: Callable[[Reply], T]
    body: bytes | None = None

    def __str__(self) -> str:
        return f"{self.operation.method} {self.operation.path}"

    def decode(self, reply: Reply) -> T:
        """Return the decoded response; raise Unexpected if it is invalid for the operation."""
        self.expect(reply.headers)
        try:
            return self.read(reply)
        except (ValueError, TypeError) as error:
            raise Unexpected(f"the answer to {self} cannot be read ({error})") from error

    def expect(self, headers: Mapping[str, str]) -> None:
        """Raise Unexpected for a media type that the operation does not have."""
        kind = errors.media_type(headers)
        if kind not in self.operation.media_types:
            expected = " or ".join(self.operation.media_types)
            raise Unexpected(f"{self} was answered with {kind}, expected {expected}")


def document(kind: type[T]) -> Callable[[Reply], T]:
    """Return the decoder of a JSON response."""
    decoder = msgspec.json.Decoder(kind)
    return lambda reply: decoder.decode(reply.content)


class Sink(Protocol):
    """Consumer of a large response in chunks."""

    def begin(self, total: int | None) -> None:
        """Discard earlier content. total: bytes to come; None if unknown."""

    def write(self, chunk: bytes) -> None:
        """Consume the next bytes."""


def address(base_url: str) -> str:
    """Return the address of a service without trailing slashes; WrongQuestion if invalid."""
    try:
        url = httpx.URL(base_url)
        valid = url.scheme in ("http", "https") and url.host and not set("?#") & set(base_url)
    except (httpx.InvalidURL, TypeError):
        valid = False
    if not valid:
        raise WrongQuestion(
            f"address {base_url!r}, expected http:// or https://, a host, and neither ? nor #"
        )
    return base_url.rstrip("/")


def client_headers(key: str | None) -> dict[str, str]:
    """Return the headers of all requests; the error for an invalid key does not contain it."""
    headers = {"User-Agent": AGENT, "Accept-Encoding": "gzip"}
    if key is None:
        return headers
    if not key.isascii() or not key.isprintable() or not key:
        raise WrongQuestion("the key is empty, or holds other than printable ASCII characters")
    return {**headers, "Authorization": f"Bearer {key}"}


def call_headers(call: Call[T], kept: Reply | None, sink: Sink | None) -> dict[str, str]:
    """Return the headers of a request. kept: cached response to revalidate."""
    headers = {} if call.body is None else {"Content-Type": "application/json"}
    if kept is not None:
        headers["If-None-Match"] = kept.headers["etag"]
    if sink is not None:
        # Without compression Content-Length gives the size of the file.
        headers["Accept-Encoding"] = "identity"
    return headers


def begin(call: Call[T], headers: Mapping[str, str], sink: Sink) -> None:
    """Begin to write a file; raise Unexpected for another media type or a compressed file."""
    call.expect(headers)
    if (coding := headers.get("content-encoding", "identity")) != "identity":
        raise Unexpected(f"{call} was answered in {coding}, expected identity")
    length = headers.get("content-length", "")
    sink.begin(int(length) if length.isdigit() else None)


def check(call: Call[T], reply: Reply) -> None:
    """Raise the error of a response without success, or of one whose end cannot be checked."""
    if reply.status != 200:
        raise errors.from_response(reply.status, reply.headers, reply.content, str(call))
    if "content-length" not in reply.headers and "transfer-encoding" not in reply.headers:
        raise IncompleteAnswer(f"the answer to {call} has no length")


def connection_error(call: Call[T], error: httpx.HTTPError, began: bool) -> PosefieldError:
    """Return the exception for an httpx error. began: True if the response had begun."""
    reason = str(error) or type(error).__name__
    if isinstance(error, httpx.TimeoutException):
        return TimedOut(f"{call}: {reason}")
    if began:
        return Broken(f"the answer to {call} broke off: {reason}")
    return Unreachable(f"{call}: {reason}")


@dataclass(frozen=True)
class Retry:
    """Exponential backoff with full jitter; all requests are idempotent.

    attempts: largest number of attempts. first: upper bound of the first wait, s; it doubles with
    each attempt up to `longest`. patience: time limit from the first attempt, s. The wait is added
    to a Retry-After of the service; if it would exceed `patience`, the request fails.
    """

    attempts: int = 5
    first: float = 0.2
    longest: float = 10.0
    patience: float = 60.0

    def wait(self, attempts: int, error: PosefieldError, elapsed: float) -> float | None:
        """Return the seconds to wait after an attempt; None to give up.

        attempts: so far. elapsed: since the first, s.
        """
        if not error.again or attempts >= self.attempts:
            return None
        jitter = min(self.longest, self.first * 2.0 ** min(attempts - 1, 64)) * random.random()
        seconds = (error.retry_after or 0.0) + jitter
        return seconds if elapsed + seconds <= self.patience else None


NEVER = Retry(attempts=1)
"""One attempt, without retries."""


class Cache:
    """Least-recently-used responses in memory, by target (RFC 9111). limit: total size, bytes.

    A response is fresh for its max-age, and is then revalidated by its entity tag.
    """

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._size = 0
        self._replies: OrderedDict[str, Reply] = OrderedDict()
        self._lock = threading.Lock()

    def find(self, target: str) -> Reply | None:
        """Return the response to a target; None if missing."""
        with self._lock:
            if target in self._replies:
                self._replies.move_to_end(target)
            return self._replies.get(target)

    def keep(self, target: str, reply: Reply) -> None:
        """Store a response if it may be stored and takes at most an eighth of the limit."""
        control = reply.headers.get("cache-control", "no-store")
        if "no-store" in control or "etag" not in reply.headers:
            return
        if len(reply.content) > self._limit // 8:
            return
        with self._lock:
            before = self._replies.pop(target, None)
            self._size += len(reply.content) - (len(before.content) if before else 0)
            self._replies[target] = replace(reply, until=_until(control))
            while self._size > self._limit:
                self._size -= len(self._replies.popitem(last=False)[1].content)

    def renew(self, target: str, kept: Reply, headers: Mapping[str, str]) -> None:
        """Extend the freshness of a response by the headers of its revalidation."""
        control = headers.get("cache-control", "")
        self.keep(target, replace(kept, headers={**kept.headers, "cache-control": control}))


def _until(control: str) -> float:
    """Return the Unix time until which a response is fresh, s; 0 for never."""
    age = _MAX_AGE.search(control)
    return time.time() + int(age[1]) if age and "no-cache" not in control else 0.0
