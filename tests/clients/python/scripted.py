"""Servers on real sockets that send scripted responses and record the requests."""

import socket
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field


@dataclass
class Scripted:
    """A server's address, and the requests that came: line, headers, body."""

    address: str
    asked: list[tuple[str, dict[str, str], bytes]] = field(default_factory=list)

    @property
    def lines(self):
        return [line for line, _, _ in self.asked]


@dataclass(frozen=True)
class Pause:
    """Seconds without a word."""

    seconds: float


Act = bytes | Pause


@contextmanager
def serving(*answers: Sequence[Act] | bytes) -> Iterator[Scripted]:
    """Each connection is read one request, answered with the next of the answers, and ended."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        server = Scripted(f"http://127.0.0.1:{listener.getsockname()[1]}")
        thread = threading.Thread(target=_serve, args=(listener, server, answers), daemon=True)
        thread.start()
        try:
            yield server
        finally:
            # Nothing ends an accept but a connection.
            with suppress(OSError), socket.create_connection(listener.getsockname(), 1):
                pass
            thread.join(10)


def _serve(listener, server, answers):
    for answer in answers:
        wire, _ = listener.accept()
        with wire, suppress(OSError):
            found = _request(wire)
            if found is None:
                return
            server.asked.append(found)
            for act in [answer] if isinstance(answer, bytes) else answer:
                time.sleep(act.seconds) if isinstance(act, Pause) else wire.sendall(act)


def _request(wire):
    stream = wire.makefile("rb")
    line = stream.readline().decode().rstrip()
    if not line:
        return None
    headers = {}
    while (given := stream.readline().decode().strip()) != "":
        name, _, value = given.partition(": ")
        headers[name.lower()] = value
    return line.rpartition(" ")[0], headers, stream.read(int(headers.get("content-length", "0")))


def answer(content=b"", kind="application/json", status=200, **headers) -> bytes:
    """A whole answer as it travels."""
    told = {"Content-Type": kind, "Content-Length": str(len(content)), "Connection": "close"}
    told |= {name.replace("_", "-"): value for name, value in headers.items() if value is not None}
    lines = "".join(f"{name}: {value}\r\n" for name, value in told.items())
    return f"HTTP/1.1 {status} Whatever\r\n{lines}\r\n".encode() + content


def chunked(*chunks, ended=True, kind="application/zip") -> bytes:
    """An answer in chunks, which may lack its end."""
    head = f"HTTP/1.1 200 OK\r\nContent-Type: {kind}\r\nTransfer-Encoding: chunked\r\n\r\n"
    sent = b"".join(b"%x\r\n%s\r\n" % (len(chunk), chunk) for chunk in chunks)
    return head.encode() + sent + (b"0\r\n\r\n" if ended else b"")
