"""Clients: those that ask and look at every answer, and those that break the rules."""

import asyncio
import random
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass

from faults_book import GONE, Book
from faults_known import Known
from faults_wire import Wire, opened

PIPELINE = 100
"""Requests that a client sends ahead of answers."""
TARGET = "/v1/models/reaching"


@dataclass(frozen=True)
class Site:
    """A service at a port, what is known of it, and what became of what was asked."""

    port: int
    references: Sequence[Known]
    book: Book
    seed: int

    def some(self, rng: random.Random, method: str | None = None) -> Known:
        """A question, of a method if one is given."""
        while True:
            one = rng.choice(self.references)
            if method in (None, one.question.method):
                return one


Client = Callable[[Site, random.Random], Awaitable[None]]


async def again(client: Client, site: Site, number: int) -> None:
    """A client for as long as the run lasts, whatever is done to its connection."""
    rng = random.Random(f"{client.__name__} {number} {site.seed}")
    while not site.book.ended:
        # A balancer sends nothing to a service that is not ready.
        while not site.book.listening:
            await asyncio.sleep(0.05)
        try:
            await client(site, rng)
        except GONE:
            await asyncio.sleep(0.05)


async def asking(site: Site, rng: random.Random) -> None:
    """One question after the other over a connection, with pauses that a drain leaves room for."""
    wire = await _connected(site)
    for _ in range(rng.randint(1, 60)):
        await _ask(site, wire, [site.some(rng)])
        if wire.is_closing or site.book.ended:
            break
        await asyncio.sleep(rng.choice((0, 0, 0.001, 0.01, 0.1)))
    wire.hang_up()


async def pipelining(site: Site, rng: random.Random) -> None:
    """Several questions at once, whose answers come in their order."""
    wire = await _connected(site)
    for _ in range(rng.randint(1, 10)):
        await _ask(site, wire, [site.some(rng) for _ in range(rng.randint(2, 12))])
        if wire.is_closing or site.book.ended:
            break
    wire.hang_up()


async def bursting(site: Site, rng: random.Random) -> None:
    """More questions at once than the service is to answer at a time."""
    await asyncio.sleep(1.0)
    await asyncio.gather(*(_once(site, rng) for _ in range(60)), return_exceptions=True)


async def slowly_reading(site: Site, rng: random.Random) -> None:
    """Answers taken bit by bit are whole all the same."""
    wire = await _connected(site, receive=4096)
    reference = next(k for k in iter(lambda: site.some(rng, "POST"), None) if _is_long(k))
    await _ask(site, wire, [reference])
    wire.hang_up()


async def hanging_up_asking(site: Site, rng: random.Random) -> None:
    """Gone in the middle of a request."""
    wire = await opened(site.port)
    content = site.some(rng).content
    await wire.send(content[: rng.randrange(len(content))])
    await asyncio.sleep(rng.choice((0, 0.001, 0.02)))
    wire.hang_up()


async def hanging_up_reading(site: Site, rng: random.Random) -> None:
    """Gone in the middle of an answer, or before it."""
    wire = await opened(site.port)
    await wire.send(site.some(rng, rng.choice(("GET", "POST"))).content)
    if rng.random() < 0.7:
        await wire.reader.read(rng.choice((1, 100, 5000)))
    wire.hang_up()


async def slowly_sending(site: Site, rng: random.Random) -> None:
    """A request bit by bit is answered as any other."""
    wire = await _connected(site)
    reference, pieces = site.some(rng, "POST"), 10
    content, seconds = reference.content, rng.choice((0.3, 1.0, 4.0))
    try:
        for number in range(pieces):
            chunk = slice(*(len(content) * i // pieces for i in (number, number + 1)))
            await wire.send(content[chunk])
            await asyncio.sleep(seconds / pieces)
        site.book.answered(reference, await wire.answer())
    except GONE as reason:
        site.book.unanswered(wire, "slow request", reason)
        raise
    wire.hang_up()


async def sending_too_much(site: Site, rng: random.Random) -> None:
    """Bodies, URLs, heads and pipelines beyond the limits."""
    name = rng.choice([*TOO_MUCH])
    content, statuses = TOO_MUCH[name]
    await _break(site, name, content, statuses)


async def sending_garbage(site: Site, rng: random.Random) -> None:
    """Send bytes that are not a request."""
    name = rng.choice([*GARBAGE, "noise"])
    content = GARBAGE.get(name) or rng.randbytes(rng.randint(1, 3000)) + b"\r\n\r\n"
    await _break(site, name, content, {400})


async def watching(site: Site, rng: random.Random) -> None:
    """Request the operators' endpoints."""
    wire = await _connected(site)
    for path in ("/livez", "/readyz", "/metrics", "/v1/models"):
        try:
            await wire.send(f"GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
            answer = await wire.answer()
        except GONE as reason:
            site.book.unanswered(wire, path, reason)
            raise
        site.book.allowed(path, answer, {200})
        if wire.is_closing:
            break
    wire.hang_up()
    await asyncio.sleep(0.2)


async def _connected(site: Site, receive: int | None = None) -> Wire:
    """A connection; that there is none is noted."""
    try:
        return await opened(site.port, receive)
    except GONE as reason:
        site.book.turned_away(reason)
        raise


async def _once(site: Site, rng: random.Random) -> None:
    wire = await _connected(site)
    await _ask(site, wire, [site.some(rng)])
    wire.hang_up()


async def _ask(site: Site, wire: Wire, requests: Sequence[Known]) -> None:
    """Send them together, and look at each answer until one says that it is the last."""
    reference = requests[0]
    try:
        await wire.send(b"".join(reference.content for reference in requests))
        for reference in requests:
            site.book.answered(reference, await wire.answer(reference.question.method))
            if wire.is_closing:
                return
    except GONE as reason:
        question = reference.question
        site.book.unanswered(wire, f"{question.method} {question.rest[:60]}", reason)
        raise


async def _break(site: Site, name: str, content: bytes, statuses: set[int]) -> None:
    wire = await opened(site.port)
    try:
        await wire.send(content)
        wire.writer.write_eof()
        answer = await wire.answer()
    except GONE:
        # To be cut off is all that they may expect.
        site.book.faulty[f"{name}: cut off"] += 1
        return
    site.book.allowed(name, answer, statuses)
    wire.hang_up()


def _is_long(reference: Known) -> bool:
    return len(reference.right[0].body) > 50_000


def _head(*lines: str) -> bytes:
    return "\r\n".join([*lines, "", ""]).encode()


_HOST = "Host: localhost"
_POST = f"POST {TARGET}/pose HTTP/1.1"
_BODY = "Content-Type: application/json"
_CODING = "Transfer-Encoding: chunked"
_CHUNKED = _head(_POST, _HOST, _BODY, _CODING)
_GET = _head("GET /livez HTTP/1.1", _HOST)
TOO_MUCH = {
    "long body": (
        _head(_POST, _HOST, _BODY, "Content-Length: 70000") + b" " * 70000,
        {413},
    ),
    "huge body": (_head(_POST, _HOST, _BODY, "Content-Length: 999999999"), {413}),
    "endless chunks": (
        _head(_POST, _HOST, _BODY, "Transfer-Encoding: chunked")
        + b"1000\r\n%b\r\n" % (b" " * 4096) * 40,
        {413},
    ),
    "long URL": (_head(f"GET {TARGET}/pose?{'x' * 20000} HTTP/1.1", _HOST), {414}),
    "large head": (
        _head("GET /livez HTTP/1.1", _HOST, *["X: " + "y" * 1000] * 40),
        {431},
    ),
    "no Host": (_head("GET /livez HTTP/1.1"), {421}),
    "long pipeline": (_GET * (3 * PIPELINE), {200}),
}
GARBAGE = {
    "TLS": bytes.fromhex("16030100f8010000f40303") + bytes(range(200)),
    "HTTP/2": b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
    "two lengths": _head(_POST, _HOST, "Content-Length: 1", "Content-Length: 2") + b"xx",
    "smuggling": _head(_POST, _HOST, "Content-Length: 4", "Transfer-Encoding: chunked")
    + b"0\r\n\r\n",
    "bad length": _head(_POST, _HOST, "Content-Length: -1"),
    "bad chunk": _CHUNKED + b"zz\r\n",
    "zero bytes": bytes(500),
}
CLIENTS: tuple[tuple[Client, int], ...] = (
    (asking, 10),
    (pipelining, 2),
    (bursting, 1),
    (slowly_reading, 1),
    (hanging_up_asking, 2),
    (hanging_up_reading, 2),
    (slowly_sending, 3),
    (sending_too_much, 1),
    (sending_garbage, 1),
    (watching, 1),
)
