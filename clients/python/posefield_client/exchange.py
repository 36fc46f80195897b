"""How an answer is come by: from what is kept or from the service, asked again where that helps.

Generators that say what is to be done next and are told what came of it: the clients, blocking and
not, differ in nothing but how they do it.
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
    """An answer that is kept, and what was read from it."""

    kept: Kept
    found: T


@dataclass(frozen=True)
class Core:
    """What a client is but for its connections. scope: digest of all that answers depend on."""

    cache: Cache
    retry: Retry
    scope: bytes
    clock: Callable[[], float] = time.monotonic

    def answer(self, call: Call[T], sink: Sink | None = None) -> Steps[T]:
        """The answer to a question, read; its content in the sink, where there is one.

        It is read before it is kept, and within what is asked again. Raises PosefieldError.
        """
        return (yield from self._with_versions(self._found(call, sink)))

    def _found(self, call: Call[T], sink: Sink | None) -> Steps[T]:
        if call.request.body is None:
            return (yield from self._got(call, sink))
        _, found = yield from self._sent(Send(call.request, None, sink), lambda r: read(call, r))
        return found

    def _got(self, call: Call[T], sink: Sink | None) -> Steps[T]:
        """The answer to a question by GET, which may be at hand."""
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
        """What is at hand; None where it cannot be read, so that it is asked for anew."""
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
        """Ask until there is an answer in which `look` finds no fault, or no hope of one."""
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
        """The same; where what came is not of our contract, the service is asked for its own."""
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
    """Version of the contract that the service says it speaks; None where it says none."""
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
    """The answer as its operation promises it; Unexpected where it is none."""
    expect(call.request.operation, reply.headers.get("content-type", ""))
    try:
        return call.read(reply)
    except (ValueError, TypeError) as fault:
        asked = named(call.request.operation)
        raise Unexpected(f"{asked} was answered with what cannot be read ({fault})") from fault


def expect(operation: Operation, content_type: str) -> None:
    """Unexpected where an answer is of none of the operation's media types."""
    found = content_type.partition(";")[0].strip()
    if found not in operation.media_types:
        expected = " or ".join(operation.media_types)
        told = found or "no media type"
        raise Unexpected(f"{named(operation)} was answered with {told}, expected {expected}")


def named(operation: Operation) -> str:
    """An operation in messages."""
    return f"{operation.method} {operation.path}"


def pour(kept: Kept, sink: Sink | None) -> None:
    """Into a sink, where there is one, what was kept."""
    if sink is not None:
        sink.begin(len(kept.content))
        sink.write(kept.content)


class Copy:
    """Sink that fills another and holds what went into it, as long as that is little."""

    def __init__(self, sink: Sink, largest: int) -> None:
        self._sink = sink
        self._largest = largest
        self._held: bytearray | None = bytearray()

    def begin(self, total: int | None) -> None:
        """Forget what came before."""
        self._held = bytearray() if (total or 0) <= self._largest else None
        self._sink.begin(total)

    def write(self, chunk: bytes) -> None:
        """Take the next bytes."""
        self._sink.write(chunk)
        if self._held is not None:
            self._held += chunk
            if len(self._held) > self._largest:
                self._held = None

    @property
    def content(self) -> bytes:
        """All that went in; nothing where that was too much."""
        return bytes(self._held or b"")
