"""How an answer is come by: from what is kept or from the service, asked again where that helps.

Generators that say what is to be done next and are told what came of it: the clients, blocking and
not, differ in nothing but how they do it.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

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


@dataclass(frozen=True)
class Core:
    """What a client is but for its connections. scope: digest of the address and the key."""

    cache: Cache
    retry: Retry
    scope: bytes
    clock: Callable[[], float] = time.monotonic

    def answer(self, call: Call[T]) -> Steps[T]:
        """The answer to a question, read. Raises PosefieldError."""
        return (yield from self.with_versions(self._read(call)))

    def _read(self, call: Call[T]) -> Steps[T]:
        reply = yield from self.reply(call.request)
        return read(call, reply)

    def reply(self, request: Request, sink: Sink | None = None) -> Steps[Reply]:
        """The answer as it came, or as it is kept; its content in the sink, where there is one."""
        if request.body is not None:
            return (yield from self._sent(Send(request, None, sink)))
        name = caches.name(self.scope, request.target)
        kept = self.cache.find(name)
        if kept is not None and kept.holds:
            return of_kept(kept, sink)
        given = Copy(sink, self.cache.largest) if sink else None
        reply = yield from self._sent(Send(request, kept.headers["etag"] if kept else None, given))
        if kept is not None and reply.status == 304:
            return of_kept(self._renewed(name, kept, reply), sink)
        self._keep(name, reply, given)
        return reply

    def _renewed(self, name: str, kept: Kept, reply: Reply) -> Kept:
        renewed = kept.renewed(reply.headers)
        if renewed.holds:
            self.cache.keep(name, renewed)
        return renewed

    def _keep(self, name: str, reply: Reply, copy: "Copy | None") -> None:
        content = reply.content if copy is None else copy.content
        if content and len(content) <= self.cache.largest:
            kept = caches.kept(reply.headers, content)
            if kept is not None:
                self.cache.keep(name, kept)

    def _sent(self, send: Send) -> Steps[Reply]:
        """Ask until there is an answer, or no hope of one."""
        began, asked = self.clock(), 0
        while True:
            asked += 1
            try:
                return (yield from _once(send))
            except PosefieldError as fault:
                wait = self.retry.wait(asked, fault, self.clock() - began)
                if wait is None:
                    raise
            yield Sleep(wait)

    def with_versions(self, steps: Steps[T]) -> Steps[T]:
        """The same; where what came is not of our contract, the service is asked for its own."""
        try:
            return (yield from steps)
        except Unexpected as fault:
            found = fault.found
        except NoSuchPath as fault:
            version = yield from contract()
            if version != CONTRACT:
                fault.add_note(f"service: contract {version}; this client: {CONTRACT}")
            raise
        raise Unexpected(found, (yield from contract()))


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


def of_kept(kept: Kept, sink: Sink | None) -> Reply:
    """An answer that was kept, as if it came."""
    if sink is None:
        return Reply(200, kept.headers, kept.content)
    sink.begin(len(kept.content))
    sink.write(kept.content)
    return Reply(200, kept.headers, b"")


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
