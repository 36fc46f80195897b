"""urllib opener with a deadline for the whole response, after which it raises TimeoutError.

A socket's own timeout restarts with each piece, so a server that sends single bytes slowly never
exceeds it, in the head, the body or an error response.
"""

import http.client
import io
import time
import urllib.request
from collections.abc import Callable
from functools import partial
from typing import Any


def opener(until: float, *handlers: Any) -> urllib.request.OpenerDirector:
    """Return an opener of urllib. until: deadline, as time.monotonic()."""
    return urllib.request.build_opener(_Http(until), _Https(until), *handlers)


class _Http(urllib.request.HTTPHandler):
    def __init__(self, until: float) -> None:
        super().__init__()
        self._until = until

    def http_open(self, request: urllib.request.Request) -> http.client.HTTPResponse:
        return self.do_open(_connected(http.client.HTTPConnection, self._until), request)


class _Https(urllib.request.HTTPSHandler):
    def __init__(self, until: float) -> None:
        super().__init__()
        self._until = until

    def https_open(self, request: urllib.request.Request) -> http.client.HTTPResponse:
        return self.do_open(_connected(http.client.HTTPSConnection, self._until), request)


def _connected(kind: Callable[..., Any], until: float) -> Any:
    def connect(host: str, **told: Any) -> Any:
        made = kind(host, **told)
        made.response_class = partial(_Answer, until=until)
        return made

    return connect


class _Answer(http.client.HTTPResponse):
    def __init__(self, sock: Any, *rest: Any, until: float, **told: Any) -> None:
        super().__init__(sock, *rest, **told)
        self.fp: Any = io.BufferedReader(_Timely(sock, self.fp.detach(), until))


class _Timely(io.RawIOBase):
    """Received bytes of a socket, each read limited to the time left."""

    def __init__(self, sock: Any, received: Any, until: float) -> None:
        self._sock, self._received, self._until = sock, received, until

    def readable(self) -> bool:
        return True

    def readinto(self, into: Any) -> int | None:
        left = self._until - time.monotonic()
        if left <= 0:
            raise TimeoutError("no time is left")
        self._sock.settimeout(left)
        found: int | None = self._received.readinto(into)
        return found

    def close(self) -> None:
        self._received.close()
        super().close()
