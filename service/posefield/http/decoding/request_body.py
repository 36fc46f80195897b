"""Request bodies, read within a limit on each and a limit on the memory of all."""

from dataclasses import dataclass

from starlette.requests import Request

from posefield.http.api.problems import BAD_BODY, BODY_TOO_LARGE, NOT_JSON, OVERLOADED, RequestError

MEDIA_TYPE = "application/json"

FREE_BYTES = 64 * 1024
"""Bytes of each body that do not count: the number of open requests bounds their memory, and small
requests succeed while large bodies exhaust the limit."""


@dataclass
class BodyMemory:
    """Memory of the bodies of open requests, beyond the first FREE bytes of each.

    limit: maximum of their sum, bytes. used: their sum, bytes.
    """

    limit: int
    used: int = 0

    def take(self, size: int) -> None:
        """Add `size` bytes; raises RequestError 503 beyond the limit."""
        if self.used + size > self.limit:
            detail = f"bodies of other requests take {self.used} of {self.limit} bytes"
            raise RequestError(OVERLOADED, detail, headers=_CLOSE | {"Retry-After": "1"})
        self.used += size

    def release(self, size: int) -> None:
        """Subtract the `size` bytes of a finished request."""
        self.used -= size


async def read_body(request: Request, limit: int, memory: BodyMemory) -> bytes:
    """Return the body of a JSON request, with a Content-Length or chunked.

    limit: bytes. `request.scope["body_memory"]` is set to the bytes taken from `memory`, also when
    this raises. Raises RequestError for another media type (415), a body beyond the limit (413), an
    incomplete body (400) and exhausted memory (503).
    """
    _check_media_type(request.headers.get("content-type", ""))
    declared = _declared_length(request)
    if declared > limit:
        raise _too_large(limit)
    found, taken = bytearray(), 0
    async for chunk in request.stream():
        found += chunk
        if len(found) > limit:
            raise _too_large(limit)
        if (beyond := len(found) - FREE_BYTES) > taken:
            memory.take(beyond - taken)
            request.scope["body_memory"] = taken = beyond
    if declared != len(found) and declared:
        # httptools skips the body of a request with an Upgrade to another protocol (h2c).
        detail = f"{len(found)} of {declared} bytes arrived; send HTTP/1.1 without `Upgrade`"
        raise RequestError(BAD_BODY, detail, {"pointer": ""}, _CLOSE)
    return bytes(found)


def _check_media_type(given: str) -> None:
    name, _, parameters = given.partition(";")
    charset = parameters.strip().lower()
    if name.strip().lower() != MEDIA_TYPE or charset not in ("", "charset=utf-8"):
        raise RequestError(NOT_JSON, f"Content-Type {given!r}, expected {MEDIA_TYPE!r}")


def _declared_length(request: Request) -> int:
    length = request.headers.get("content-length", "")
    return int(length) if length.isascii() and length.isdigit() and len(length) < 20 else 0


def _too_large(limit: int) -> RequestError:
    detail = f"more than {limit} bytes, expected at most {limit}"
    return RequestError(BODY_TOO_LARGE, detail, headers=_CLOSE)


# The client may still be sending the rest of the body: closing the connection stops it.
_CLOSE = {"Connection": "close"}
