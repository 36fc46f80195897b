"""HTTP on the socket: uvicorn's reader and writer, with bounds on what a client sends, takes and
how long. What is refused here is refused in the one shape that every fault has, in its turn."""

import asyncio
import enum
from typing import Any, ClassVar

import httptools
from uvicorn.protocols.http.flow_control import HIGH_WATER_LIMIT
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol, RequestResponseCycle

from service.web import refusals
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

    since: when it began to wait for what `phase` says. first, after: bytes of the piece in which
    the request that is being read began, and of those after it; body: of its body. refused:
    whether a fault is the last answer.
    """

    limits: ClassVar[Limits]
    watch: ClassVar[Watch]

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.phase = IDLE
        self.since = self.loop.time()
        self.piece = self.first = self.after = self.body = self.hosts = 0
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
        self.piece = len(data)
        self.after += self.piece
        try:
            self.parser.feed_data(data)
        except httptools.HttpParserUpgrade as upgrade:
            self._read_again(data[upgrade.args[0] :])
            return
        except httptools.HttpParserError as broken:
            self._refuse(self.fault or refusals.of_parser(broken))
            return
        if self.phase is HEAD:
            self._check_unfinished_head()
        elif self.phase is BODY:
            self._check_framing()

    def on_message_begin(self) -> None:
        super().on_message_begin()
        self.phase, self.since = HEAD, self.loop.time()
        self.first, self.after = self.piece, 0
        self.body = self.hosts = 0

    def on_header(self, name: bytes, value: bytes) -> None:
        name = name.lower()
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
        limits, size = self.limits, self.first + self.after
        if size > limits.least or self.hosts != 1 or self.codings or len(self.headers) > FIELDS:
            self._check_head()
        super().on_headers_complete()
        # What comes now are trailers: as headers they would get past whoever looked at those.
        self.headers = []
        self.phase, self.since = BODY, self.loop.time()
        if len(self.pipeline) >= PIPELINE:
            self.fault = refusals.malformed(f"more than {PIPELINE} requests ahead of answers")
            raise self.fault

    def on_body(self, body: bytes) -> None:
        self.body += len(body)
        cycle = self.cycle
        if cycle.response_complete:
            if self.body > UNREAD:
                self.transport.close()
            return
        cycle.body += body
        if len(cycle.body) > HIGH_WATER_LIMIT:
            self.flow.pause_reading()
        cycle.message_event.set()

    def on_message_complete(self) -> None:
        if self.parser.should_upgrade():
            return
        cycle = self.cycle
        if cycle.response_complete:
            self.phase, self.since = IDLE, self.loop.time()
            return
        self.phase = WHOLE
        cycle.more_body = False
        cycle.message_event.set()

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
            self._refuse(refusals.too_slow("head", limits.head_time))
        elif self.phase is BODY and waited > limits.body_time + self.body / SLOWEST:
            if answered:
                self.transport.close()
            else:
                self._refuse(refusals.too_slow("body", limits.body_time))

    def _make_room(self) -> None:
        unused = [c for c in self.connections if isinstance(c, Bounded) and c.is_unused(self)]
        if unused:
            min(unused, key=lambda connection: connection.since).transport.close()
        elif len(self.connections) > 2 * self.limits.connections:
            self.wire.abort()
        else:
            self._refuse(refusals.no_connection_left(self.limits))

    def is_unused(self, other: "Bounded") -> bool:
        """Whether nothing is being asked here, and another has more use for the place."""
        return self is not other and self.phase is IDLE and not self.wire.is_closing()

    # What is refused ----------------------------------------------------------------------------

    def _check_head(self) -> None:
        version = self.parser.get_http_version()
        head = refusals.Head(self.url, self.headers, self.hosts, self.codings, version)
        self.codings = []
        if fault := refusals.of_head(head, self.limits):
            # The parser tells of an exception in what it calls, but not which one.
            self.fault = fault
            raise fault

    def _check_unfinished_head(self) -> None:
        if len(self.url) > self.limits.url:
            self._refuse(refusals.too_long(self.limits))
        elif self.after > self.limits.most:
            self._refuse(refusals.too_large(self.limits))

    def _check_framing(self) -> None:
        """Chunk sizes may have extensions, and bodies trailers: without end, if nobody counts."""
        if self.after - self.body * FRAMING > 2 * self.limits.most:
            self._refuse(refusals.malformed("a chunked body of hardly any content"))

    def _read_again(self, rest: bytes) -> None:
        """Read a request as if it did not want another protocol, which RFC 9110, 7.8 allows."""
        method = self.parser.get_method()
        if method == b"CONNECT":
            self._refuse(refusals.malformed("CONNECT: this is no proxy"))
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
        headers = self.scope["headers"] if self.phase in (HEAD, BODY) else []
        scope: dict[str, Any] = {
            "type": "http",
            "asgi": {"version": self.asgi_version, "spec_version": "2.3"},
            "http_version": "1.1",
            "server": self.server,
            "client": self.client,
            "scheme": self.scheme,
            "root_path": self.root_path,
            "headers": headers,
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
