"""HTTP parts shared by both clients: addresses, headers, and the meaning of httpx errors."""

import gzip
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import httpx

from posefield_client import cache as caches
from posefield_client.cache import Cache, Memory
from posefield_client.disk import Disk
from posefield_client.errors import (
    Broken,
    IncompleteAnswer,
    PosefieldError,
    TimedOut,
    Unexpected,
    Unreachable,
    WrongQuestion,
)
from posefield_client.exchange import Core, expect, named
from posefield_client.generated import CONTRACT
from posefield_client.retry import Retry
from posefield_client.wire import Reply, Send

AGENT = f"posefield-client/{version('posefield-client')}"


@dataclass(frozen=True)
class Place:
    """Address of a service, with the headers and timeout of every request."""

    address: str
    headers: dict[str, str]
    timeout: httpx.Timeout

    def request(self, send: Send) -> httpx.Request:
        """Return the request for httpx; the httpx client's own method would add default headers."""
        asked = send.request
        headers = self.headers
        if send.tag is not None:
            headers = {**headers, "If-None-Match": send.tag}
        if send.sink is not None:
            # Without compression Content-Length gives the size of the file to check.
            headers = {**headers, "Accept-Encoding": "identity"}
        if asked.body is not None:
            headers = {**headers, "Content-Type": "application/json"}
        return httpx.Request(
            asked.operation.method,
            self.address + asked.target,
            headers=headers,
            content=asked.body,
            extensions={"timeout": self.timeout.as_dict()},
        )


def place(base_url: str, key: str | None, timeout: float | httpx.Timeout) -> Place:
    """Return the service at an address; WrongQuestion if the address is invalid."""
    headers = {"User-Agent": AGENT, "Accept-Encoding": "gzip"}
    if key is not None:
        headers["Authorization"] = f"Bearer {_printable(key)}"
    return Place(_address(base_url), headers, httpx.Timeout(timeout))


def _address(base_url: str) -> str:
    try:
        found = httpx.URL(base_url)
        whole = found.scheme in ("http", "https") and found.host and not set("?#") & set(base_url)
    except (httpx.InvalidURL, TypeError):
        whole = False
    if not whole:
        raise WrongQuestion(
            f"address {base_url!r}, expected http:// or https://, a host, and neither ? nor #"
        )
    return base_url.rstrip("/")


def _printable(key: str) -> str:
    """Return the key; the error message does not contain it."""
    if not key.isascii() or not key.isprintable() or not key:
        raise WrongQuestion("the key is empty, or holds other than printable ASCII characters")
    return key


def core(place: Place, retry: Retry, cache: Cache | Path | None) -> Core:
    """Return the state of a client. cache: None for a new Memory."""
    scope = caches.scope(CONTRACT, place.address, place.headers.get("Authorization", ""))
    kept = Disk(cache) if isinstance(cache, Path) else cache
    return Core(Memory() if kept is None else kept, retry, scope)


def begin(send: Send, response: httpx.Response) -> Callable[[bytes], None] | None:
    """Return the function that consumes a response in chunks; None to read it at once."""
    if send.sink is None or response.status_code != 200:
        return None
    expect(send.request.operation, response.headers.get("content-type", ""))
    if (coding := _coding(response)) != "identity":
        asked = named(send.request.operation)
        raise Unexpected(f"{asked} was answered in {coding}, expected identity")
    length = response.headers.get("content-length", "")
    send.sink.begin(int(length) if length.isdigit() else None)
    return send.sink.write


def _coding(response: httpx.Response) -> str:
    said: str = response.headers.get("content-encoding", "identity")
    return said.strip().lower()


def reply(send: Send, response: httpx.Response, raw: bytes) -> Reply:
    """Return the response with its complete body `raw`.

    Raises IncompleteAnswer if the headers do not allow checking its length.
    """
    headers = response.headers
    endless = "content-length" not in headers and "transfer-encoding" not in headers
    if endless and response.status_code == 200:
        asked = named(send.request.operation)
        raise IncompleteAnswer(f"the answer to {asked} does not say where it ends")
    return Reply(response.status_code, headers, _decoded(send, _coding(response), raw))


def _decoded(send: Send, coding: str, raw: bytes) -> bytes:
    """Return the decompressed body; httpx would accept truncated gzip as complete."""
    if not raw or coding == "identity":
        return raw
    asked = named(send.request.operation)
    if coding != "gzip":
        raise Unexpected(f"{asked} was answered in {coding}, expected gzip or identity")
    try:
        return gzip.decompress(raw)
    except EOFError as found:
        raise IncompleteAnswer(f"the answer to {asked} broke off: {found}") from found
    except (OSError, zlib.error) as found:
        raise Broken(f"the answer to {asked} is no gzip: {found}") from found


def opened(http: httpx.Client | httpx.AsyncClient) -> None:
    """Raise WrongQuestion if the client was closed."""
    if http.is_closed:
        raise WrongQuestion("the client is closed")


def fault(found: httpx.HTTPError, send: Send, began: bool) -> PosefieldError:
    """Return the exception for an httpx error. began: True if the response had begun."""
    asked = named(send.request.operation)
    told = str(found) or type(found).__name__
    if isinstance(found, httpx.TimeoutException):
        return TimedOut(f"{asked}: {told}")
    if began:
        return Broken(f"the answer to {asked} broke off: {told}")
    return Unreachable(f"{asked}: {told}")
