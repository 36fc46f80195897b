"""Server that sends scripted bytes, valid HTTP or not."""

import contextlib
import socket
import threading


class Scripted:
    """A server at a raw socket. requests: what was asked, as bytes."""

    def __init__(self, pieces, pause):
        self.pieces, self.pause, self.requests = pieces, pause, []
        self._ended = threading.Event()
        self._socket = socket.create_server(("127.0.0.1", 0))
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    @property
    def address(self):
        return f"http://127.0.0.1:{self._socket.getsockname()[1]}"

    def close(self):
        self._ended.set()
        # Wakes the thread up, which otherwise waits for somebody to call.
        with contextlib.suppress(OSError):
            socket.create_connection(self._socket.getsockname(), timeout=5).close()
        self._thread.join(10)
        self._socket.close()

    def _run(self):
        while not self._ended.is_set():
            wire, _ = self._socket.accept()
            with wire, contextlib.suppress(OSError):
                self._answer(wire)

    def _answer(self, wire):
        wire.settimeout(5)
        self.requests.append(wire.recv(65536))
        for piece in self.pieces:
            wire.sendall(piece)
            self._ended.wait(self.pause)


def answer(body, status="200 OK", **headers):
    """An answer of HTTP as bytes."""
    given = {"Content-Length": str(len(body)), "Connection": "close", **headers}
    lines = [f"HTTP/1.1 {status}", *(f"{k.replace('_', '-')}: {v}" for k, v in given.items())]
    return "\r\n".join([*lines, "", ""]).encode() + body
