"""Checks of the shipped nginx configuration against clients that send or read slowly, keep idle
connections or open many."""

import http.server
import socket
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

import proxy
import running

# Shorter than in the configuration, and far from nginx's defaults of 60 s and more.
SHORT = {
    "client_header_timeout 10s;": "client_header_timeout 1s;",
    "client_body_timeout 20s;": "client_body_timeout 1s;",
    "send_timeout 30s;": "send_timeout 1s;",
    "keepalive_timeout 75s;\n    large": "keepalive_timeout 1s;\n    large",
    "limit_conn connections 100;": "limit_conn connections 5;",
}
# Directives without which each check must find its fault.
NEEDED = {
    "client_header_timeout 1s;": ("", "half a head"),
    "client_body_timeout 1s;": ("", "half a body"),
    "send_timeout 1s;": ("", "an answer that is not read"),
    "keepalive_timeout 1s;": ("", "an idle connection"),
    "limit_conn connections 5;": ("", "many connections"),
    "proxy_request_buffering on;": ("proxy_request_buffering off;", "unfinished bodies"),
}
# Seconds within which nginx cuts a connection off; many times those that it is told.
PATIENCE = 8.0
# Bytes of an answer: more than all buffers of the kernel hold.
LONG = 32_000_000
HEAD = b"POST /body HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1000\r\n\r\n"
GET = b"GET /%s HTTP/1.1\r\nHost: localhost\r\n\r\n"


@dataclass
class Upstream:
    """Stands for the service; counts the requests that reach it."""

    port: int = 0
    heads: list[str] = field(default_factory=list)


def faults() -> list[str]:
    """Return a line for each slow client that keeps its connection, or is not noticed in a test
    without the directive."""
    ours = proxy.CONF.read_text()
    for usual, short in SHORT.items():
        ours = proxy.replaced(ours, usual, short)
    return proxy.configuration_faults("slow clients", ours, NEEDED, _faults)


def _faults(text: str) -> list[str]:
    with tempfile.TemporaryDirectory() as name, _upstream() as upstream:
        folder, (port,) = Path(name), running.ports(1)
        command = proxy.command(folder, text, upstream.port, port)
        with running.started(command, folder / "nginx.txt"):
            running.wait(lambda: _answered(port))
            return [*_cut_off(port), *_many(port), *_unfinished(upstream)]


def _cut_off(port: int) -> Iterator[str]:
    """Faults of clients that stop sending or reading."""
    with ExitStack() as opened:
        clients = {
            "half a head": _client(opened, port, HEAD[:40]),
            "half a body": _client(opened, port, HEAD + b"x" * 500),
            "an idle connection": _client(opened, port, GET % b"short"),
            "an answer that is not read": _client(opened, port, GET % b"long"),
        }
        unread = clients.pop("an answer that is not read")
        end = time.monotonic() + PATIENCE
        for name, client in clients.items():
            if not _ends(client, end):
                yield f"{name} keeps its connection"
        # Of an answer that is not read, the kernel keeps a part: the end is missing.
        time.sleep(max(0.0, end - time.monotonic()))
        if (found := _received(unread)) >= LONG:
            yield f"an answer that is not read is sent whole, {found} bytes"


def _many(port: int) -> Iterator[str]:
    """Faults of an address that has more connections than it may."""
    with ExitStack() as opened:
        held = [_client(opened, port, HEAD) for _ in range(5)]
        time.sleep(0.3)
        last = _client(opened, port, GET % b"short").recv(100)
        if b" 503 " not in last:
            yield f"many connections: {len(held) + 1} of one address, answered {last[:20]!r}"


def _unfinished(upstream: Upstream) -> Iterator[str]:
    if "/body" in upstream.heads:
        yield "unfinished bodies reach the service"


def _client(opened: ExitStack, port: int, sent: bytes) -> socket.socket:
    client = opened.enter_context(socket.socket())
    client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    client.settimeout(PATIENCE)
    client.connect(("127.0.0.1", port))
    client.sendall(sent)
    return client


def _ends(client: socket.socket, end: float) -> bool:
    """Return whether the other side closes the connection before a time."""
    try:
        while True:
            client.settimeout(max(0.01, end - time.monotonic()))
            if not client.recv(4096):
                return True
    except TimeoutError:
        return False
    except ConnectionError:
        return True


def _received(client: socket.socket) -> int:
    """Return how many bytes come until the other side closes, or sends none for a second."""
    count = 0
    client.settimeout(1.0)
    try:
        while some := client.recv(1 << 20):
            count += len(some)
    except (TimeoutError, ConnectionError):
        pass
    return count


def _answered(port: int) -> bool:
    with ExitStack() as opened:
        try:
            return _client(opened, port, GET % b"short").recv(100).startswith(b"HTTP/1.1 200")
        except ConnectionError:
            return False


@contextmanager
def _upstream() -> Iterator[Upstream]:
    made = Upstream()

    class Handler(http.server.BaseHTTPRequestHandler):
        def _answer(self) -> None:
            made.heads.append(self.path)
            content = b"x" * (LONG if self.path == "/long" else 10)
            with suppress(ConnectionError):
                self.rfile.read(int(self.headers.get("Content-Length", 0)))
                self.send_response(200)
                self.send_header("Content-Length", str(len(content)))
                self.end_headers()
                self.wfile.write(content)

        do_GET = do_POST = _answer

        def log_message(self, *_: object) -> None:
            pass

    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        made.port = server.server_port
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield made
        finally:
            server.shutdown()
            thread.join()


if __name__ == "__main__":
    found = faults()
    print("\n".join(found) or "no fault of slow clients before the service")
    sys.exit(bool(found))
