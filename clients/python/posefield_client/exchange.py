"""Responses from the cache, or over HTTP with retries.

The generators yield the steps to execute and receive their results, so that the synchronous and the
asynchronous client share all logic but the execution.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import msgspec

from posefield_client import cache as caches
from posefield_client import errors
from posefield_client.cache import Cache, Kept
from posefield_client.errors import NoSuchPath, PosefieldError, Unexpected
from posefield_client.generated import CONTRACT, OPERATIONS, Operation
from posefield_client.retry import Retry
from posefield_client.wire import Call, Reply, Request, Send, Sink, Sleep, Steps

T = TypeVar("T")

LIVENESS = Request(OPERATIONS["getLiveness"], "/livez")
DOCUMENT = Request(OPERATIONS["getContractJson"], "/openapi.json")


@dataclass(frozen=True, slots=True)
class Held(Generic[T]):
    """A cached response and its decoded value."""

    kept: Kept
    found: T


@dataclass(frozen=True)
class Core:
    """State of a client without its connections. scope: digest of all that responses depend on."""

    cache: Cache
    retry: Retry
    scope: bytes
    clock: Callable[[], float] = time.monotonic

    def answer(self, call: Call[T], sink: Sink | None = None) -> Steps[T]:
        """Yield the steps of a request and return the decoded response.

        sink: receives the content; None to hold it in memory. Decoding is part of each attempt, and
        precedes caching. Raises PosefieldError.
        """
        return (yield from self._with_versions(self._found(call, sink)))

    def _found(self, call: Call[T], sink: Sink | None) -> Steps[T]:
        if call.request.body is None:
            return (yield from self._got(call, sink))
        _, found = yield from self._sent(Send(call.request, None, sink), lambda r: read(call, r))
        return found

    def _got(self, call: Call[T], sink: Sink | None) -> Steps[T]:
        """Return the response to a GET request, from the cache if it is fresh."""
        name = caches.name(self.scope, call.request.target)
        held = self._held(name, call)
        if held is not None and held.kept.holds:
            pour(held.kept, sink)
            return held.found

        def look(reply: Reply) -> T:
            return held.found if held and reply.status == 304 else read(call, reply)

        given = Copy(sink, self.cache.largest) if sink else None
        tag = held.kept.headers["etag"] if held else None
        reply, found = yield from self._sent(Send(call.request, tag, given), look)
        if held and reply.status == 304:
            self._renew(name, held.kept, reply)
            pour(held.kept, sink)
        else:
            self._keep(name, reply, given)
        return found

    def _held(self, name: str, call: Call[T]) -> Held[T] | None:
        """Return the cached response; None if missing or not decodable."""
        kept = self.cache.find(name)
        if kept is None:
            return None
        try:
            return Held(kept, read(call, Reply(200, kept.headers, kept.content)))
        except Unexpected:
            return None

    def _renew(self, name: str, kept: Kept, reply: Reply) -> None:
        renewed = kept.renewed(reply.headers)
        if renewed.holds:
            self.cache.keep(name, renewed)

    def _keep(self, name: str, reply: Reply, copy: "Copy | None") -> None:
        content = reply.content if copy is None else copy.content
        if content and len(content) <= self.cache.largest:
            kept = caches.kept(reply.headers, content)
            if kept is not None:
                self.cache.keep(name, kept)

    def _sent(self, send: Send, look: Callable[[Reply], T]) -> Steps[tuple[Reply, T]]:
        """Send until `look` accepts a response, or retries are exhausted."""
        began, asked = self.clock(), 0
        while True:
            asked += 1
            try:
                reply = yield from _once(send)
                return reply, look(reply)
            except PosefieldError as fault:
                wait = self.retry.wait(asked, fault, self.clock() - began)
                if wait is None:
                    raise
            yield Sleep(wait)

    def _with_versions(self, steps: Steps[T]) -> Steps[T]:
        """Run steps; add the service's contract version to errors that violate the contract."""
        try:
            return (yield from steps)
        except Unexpected as fault:
            found, cause = fault.found, fault.__cause__
        except NoSuchPath as fault:
            version = yield from contract()
            if version != CONTRACT:
                fault.add_note(f"service: contract {version}; this client: {CONTRACT}")
            raise
        raise Unexpected(found, (yield from contract())) from cause


def _once(send: Send) -> Steps[Reply]:
    reply = yield send
    assert reply is not None
    if reply.status == 200 or (reply.status == 304 and send.tag):
        return reply
    asked = named(send.request.operation)
    raise errors.of_answer(reply.status, reply.headers, reply.content, asked)


def contract() -> Steps[str | None]:
    """Return the contract version that the service reports; None if it reports none."""
    for request, keys in ((LIVENESS, ("contract",)), (DOCUMENT, ("info", "version"))):
        try:
            reply = yield Send(request)
            assert reply is not None
            found: Any = msgspec.json.decode(reply.content)
            for key in keys:
                found = found[key]
        except (PosefieldError, msgspec.DecodeError, KeyError, TypeError):
            continue
        if isinstance(found, str):
            return found
    return None


def read(call: Call[T], reply: Reply) -> T:
    """Return the decoded response; raise Unexpected if it is invalid for its operation."""
    expect(call.request.operation, reply.headers.get("content-type", ""))
    try:
        return call.read(reply)
    except (ValueError, TypeError) as fault:
        asked = named(call.request.operation)
        raise Unexpected(f"{asked} was answered with what cannot be read ({fault})") from fault


def expect(operation: Operation, content_type: str) -> None:
    """Raise Unexpected for a media type that the operation does not have."""
    found = content_type.partition(";")[0].strip()
    if found not in operation.media_types:
        expected = " or ".join(operation.media_types)
        told = found or "no media type"
        raise Unexpected(f"{named(operation)} was answered with {told}, expected {expected}")


def named(operation: Operation) -> str:
    """Return an operation's name for messages."""
    return f"{operation.method} {operation.path}"


def pour(kept: Kept, sink: Sink | None) -> None:
    """Write a cached response to a sink, if there is one."""
    if sink is not None:
        sink.begin(len(kept.content))
        sink.write(kept.content)


class Copy:
    """Sink that forwards to another and keeps a copy of up to `largest` bytes."""

    def __init__(self, sink: Sink, largest: int) -> None:
        self._sink = sink
        self._largest = largest
        self._held: bytearray | None = bytearray()

    def begin(self, total: int | None) -> None:
        """Discard earlier content."""
        self._held = bytearray() if (total or 0) <= self._largest else None
        self._sink.begin(total)

    def write(self, chunk: bytes) -> None:
        """Forward and copy the next bytes."""
        self._sink.write(chunk)
        if self._held is not None:
            self._held += chunk
            if len(self._held) > self._largest:
                self._held = None

    @property
    def content(self) -> bytes:
        """Return the copy; empty if the content was too large."""
        return bytes(self._held or b"")
