"""HTTP on the socket: uvicorn's reader and writer, with bounds on what a client sends, takes and
how long. What is refused here is refused in the one shape that every fault has, in its turn."""

import asyncio
import enum
from typing import Any, ClassVar

import httptools
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol, RequestResponseCycle

from service.web import problems
from service.web.patience import FIELDS, PERIOD, Limits, Watch
from service.web.problems import RequestFault
from service.web.wire import SLOWEST, Wire

FAULT = "posefield.fault"
"""Where the application finds, in a scope, the RequestFault that it has to answer with."""

PIPELINE = 100
"""Requests that a client may send ahead of their answers."""

UNREAD = 256 * 1024
"""Bytes of a body that are read for nothing where its request was answered before it had come."""

FRAMING = 16
"""Bytes of chunk sizes for each byte of a body: a chunk of one byte takes 6."""


class Phase(enum.Enum):
    """What is awaited of a client: a request, the rest of its head, of its body, or nothing."""

    IDLE = enum.auto()
    HEAD = enum.auto()
    BODY = enum.auto()
    WHOLE = enum.auto()


IDLE, HEAD, BODY, WHOLE = Phase


def bounded(limits: Limits) -> type["Bounded"]:
    """The protocol with these limits, for uvicorn's `http`."""
    return type("Bounded", (Bounded,), {"limits": limits, "watch": Watch()})


class Bounded(HttpToolsProtocol):
    """One connection.

    since: when it began to wait for what `phase` says. received: bytes of the request that is being
    read, head: of its header lines, body: of its body. refused: whether a fault is the last answer.
    """

    limits: ClassVar[Limits]
    watch: ClassVar[Watch]

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.phase = IDLE
        self.since = self.loop.time()
        self.received = self.head = self.body = self.hosts = 0
        self.codings: list[bytes] = []
        self.refused = False
        self.fault: RequestFault | None = None

    # What arrives -----------------------------------------------------------------------------

    def connection_made(self, transport: Any) -> None:
        """Take a connection; where there is none left, end an unused one, or refuse this one."""
        self.wire = Wire(transport, self._is_sending, self.limits.drain_time)
        super().connection_made(self.wire)  # type: ignore[arg-type]
        self.watch.start(self.loop, self.connections)  # type: ignore[arg-type]
        if len(self.connections) > self.limits.connections:
            self._make_room()

    def data_received(self, data: bytes) -> None:
        """Read what a client sent."""
        if self.refused or self.wire.left:
            self.wire.drop(data)
            return
        self.received += len(data)
        try:
            self.parser.feed_data(data)
        except httptools.HttpParserUpgrade as upgrade:
            self._read_again(data[upgrade.args[0] :])
            return
        except httptools.HttpParserError as broken:
            self._refuse(self.fault or RequestFault(problems.MALFORMED, _said(broken)))
            return
        if self.phase is HEAD:
            self._check_unfinished_head()
        elif self.phase is BODY:
            self._check_framing()

    def on_message_begin(self) -> None:
        super().on_message_begin()
        self.phase, self.since = HEAD, self.loop.time()
        self.head = self.body = self.hosts = 0
        if self.codings:
            self.codings = []

    def on_header(self, name: bytes, value: bytes) -> None:
        if self.phase is not HEAD:
            # A trailer: to take it for a header would let it past whoever looked at those.
            return
        name = name.lower()
        self.head += len(name) + len(value) + 4
        if name in _OF_READING:
            self._note(name, value.strip().lower())
        self.headers.append((name, value))

    def _note(self, name: bytes, value: bytes) -> None:
        if name == b"host":
            self.hosts += 1
        elif name == b"transfer-encoding":
            self.codings.append(value)
        elif value == b"100-continue":
            self.expect_100_continue = True

    def on_headers_complete(self) -> None:
        if self.parser.should_upgrade():
            return
        self._check_head()
        super().on_headers_complete()
        self.phase, self.since = BODY, self.loop.time()
        if len(self.pipeline) >= PIPELINE:
            raise self._fault(problems.MALFORMED, f"more than {PIPELINE} requests ahead of answers")

    def on_body(self, body: bytes) -> None:
        self.body += len(body)
        if self.cycle.response_complete and self.body > UNREAD:
            self.transport.close()
        super().on_body(body)

    def on_message_complete(self) -> None:
        if self.parser.should_upgrade():
            return
        self.received = 0
        if self.cycle.response_complete:
            self.phase, self.since = IDLE, self.loop.time()
        else:
            self.phase = WHOLE
        super().on_message_complete()

    # What is sent -------------------------------------------------------------------------------

    def pause_writing(self) -> None:
        """The client takes less than it is sent."""
        super().pause_writing()
        self.wire.owe()

    def resume_writing(self) -> None:
        """The client has taken most of it."""
        super().resume_writing()
        self.wire.settle()

    def on_response_complete(self) -> None:
        """Go on to the request that is next.

        As in the parent but for its timer of unused connections, which `look` replaces, and for
        reading, which goes on only when all that was asked ahead is being answered.
        """
        self.server_state.total_requests += 1
        if self.transport.is_closing():
            return
        self.since = self.loop.time()
        if self.pipeline:
            self._start_asgi_task(*self.pipeline.pop())
        elif self.phase is WHOLE:
            self.phase = IDLE
        if not self.pipeline:
            self.flow.resume_reading()

    def _is_sending(self) -> bool:
        return self.refused or self.phase in (HEAD, BODY) or self.flow.read_paused

    # What takes too long ------------------------------------------------------------------------

    def look(self, now: float) -> None:
        """End what took too long."""
        self.wire.look(now)
        if self.wire.is_closing() or self.refused:
            return
        if self.flow.read_paused:
            # It is we who are not reading.
            self.since += PERIOD
        waited, limits = now - self.since, self.limits
        answered = self.cycle is None or self.cycle.response_complete
        if self.phase is IDLE and waited > limits.idle_time:
            self.transport.close()
        elif self.phase is HEAD and answered and waited > limits.head_time:
            self._refuse(self._too_slow("head", limits.head_time))
        elif self.phase is BODY and waited > limits.body_time + self.body / SLOWEST:
            if answered:
                self.transport.close()
            else:
                self._refuse(self._too_slow("body", limits.body_time))

    def _make_room(self) -> None:
        unused = [c for c in self.connections if isinstance(c, Bounded) and c.is_unused(self)]
        if unused:
            min(unused, key=lambda connection: connection.since).transport.close()
        elif len(self.connections) > 2 * self.limits.connections:
            self.wire.abort()
        else:
            detail = f"{self.limits.connections} are open, expected fewer"
            later = {"Retry-After": "1"}
            self._refuse(RequestFault(problems.NO_CONNECTION_LEFT, detail, headers=later))

    def is_unused(self, other: "Bounded") -> bool:
        """Whether nothing is being asked here, and another has more use for the place."""
        return self is not other and self.phase is IDLE and not self.wire.is_closing()

    # What is refused ----------------------------------------------------------------------------

    def _fault(self, kind: problems.Kind, detail: str) -> RequestFault:
        # The parser tells of an exception in what it calls, but not which one.
        self.fault = RequestFault(kind, detail)
        return self.fault

    def _check_head(self) -> None:
        limits, version = self.limits, self.parser.get_http_version()
        if len(self.url) > limits.url:
            raise self._too_long()
        if self.head > limits.head or len(self.headers) > FIELDS:
            raise self._too_large()
        if version not in ("1.1", "1.0"):
            raise self._fault(problems.MALFORMED, f"HTTP/{version}, expected HTTP/1.1")
        if self.hosts != 1 and (version == "1.1" or self.hosts):
            # Who reads one of two, and who the other, do not see the same request (RFC 9112, 3.2).
            raise self._fault(problems.MALFORMED, f"{self.hosts} Host headers, expected one")
        if self.codings and (self.codings != [b"chunked"] or version != "1.1"):
            raise self._fault(problems.MALFORMED, "Transfer-Encoding, expected none or chunked")

    def _check_unfinished_head(self) -> None:
        if len(self.url) > self.limits.url:
            self._refuse(self._too_long())
        elif self.received > self.limits.url + self.limits.head:
            self._refuse(self._too_large())

    def _check_framing(self) -> None:
        """Chunk sizes may have extensions, and bodies trailers: without end, if nobody counts."""
        if self.received - self.body * FRAMING > 2 * (self.limits.url + self.limits.head):
            self._refuse(self._fault(problems.MALFORMED, "a chunked body of hardly any content"))

    def _too_long(self) -> RequestFault:
        most = self.limits.url
        return self._fault(
            problems.URL_TOO_LONG, f"more than {most} bytes, expected at most {most}"
        )

    def _too_large(self) -> RequestFault:
        detail = f"expected at most {self.limits.head} bytes in at most {FIELDS} headers"
        return self._fault(problems.HEAD_TOO_LARGE, detail)

    def _too_slow(self, what: str, seconds: int) -> RequestFault:
        return self._fault(problems.TOO_SLOW, f"its {what} was expected within {seconds} seconds")

    def _read_again(self, rest: bytes) -> None:
        """Read a request as if it did not want another protocol, which RFC 9110, 7.8 allows."""
        method = self.parser.get_method()
        if method == b"CONNECT":
            self._refuse(RequestFault(problems.MALFORMED, "CONNECT: this is no proxy"))
            return
        fields = [b"%b: %b\r\n" % pair for pair in self.headers if pair[0] != b"upgrade"]
        head = b"%b %b HTTP/1.1\r\n%b\r\n" % (method, self.url, b"".join(fields))
        self.parser = httptools.HttpRequestParser(self)
        self.data_received(head + rest)

    def _refuse(self, fault: RequestFault) -> None:
        """Answer with a fault after what was asked before, then end."""
        self.refused = True
        cycle = self.cycle
        waiting = cycle is not None and not cycle.response_complete
        if waiting and self.phase is BODY:
            # The fault is in the very request that `cycle` is to answer, or is answering.
            if self.pipeline:
                self.pipeline.popleft()
                waiting = True
            elif cycle.response_started:
                self.wire.abort()
                return
            else:
                # Its handler is told that the client has gone, and nobody hears what it says.
                cycle.disconnected, waiting = True, False
                cycle.message_event.set()
        self.cycle = self._last(fault)
        if waiting:
            self.pipeline.appendleft((self.cycle, self.app))
        else:
            self._start_asgi_task(self.cycle, self.app)

    def _last(self, fault: RequestFault) -> RequestResponseCycle:
        """The answer to a request that was not read: nothing of it but its headers is known."""
        scope: dict[str, Any] = {
            "type": "http",
            "asgi": {"version": self.asgi_version, "spec_version": "2.3"},
            "http_version": "1.1",
            "server": self.server,
            "client": self.client,
            "scheme": self.scheme,
            "root_path": self.root_path,
            "headers": self.headers or [],
            "state": self.app_state.copy(),
            "method": "GET",
            "path": "",
            "raw_path": b"",
            "query_string": b"",
            FAULT: fault,
        }
        return RequestResponseCycle(
            scope=scope,  # type: ignore[arg-type]
            transport=self.transport,
            flow=self.flow,
            logger=self.logger,
            access_logger=self.access_logger,
            access_log=self.access_log,
            default_headers=self.server_state.default_headers,
            message_event=asyncio.Event(),
            expect_100_continue=False,
            keep_alive=False,
            on_response=self.on_response_complete,
        )


_OF_READING = frozenset({b"host", b"transfer-encoding", b"expect"})


def _said(broken: httptools.HttpParserError) -> str:
    if isinstance(broken, httptools.HttpParserCallbackError):
        return "its URL cannot be read"
    return f"{broken}"
