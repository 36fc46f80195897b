"""Requests: their heads, bodies and deadlines, and the service that they share.

A page of another origin can make a browser send requests to a local service under the page's host
name (DNS rebinding). The browser then sends that name as Host, not an address or a listed name.
"""

import asyncio
import ipaddress
import os
import re
import time
from asyncio import Task
from collections.abc import Awaitable, Mapping
from dataclasses import dataclass, field
from itertools import count
from typing import Any, TypeVar
from urllib.parse import parse_qsl

from msgspec import Struct
from starlette.requests import Request
from starlette.types import Message, Receive, Scope, Send

from posefield.characters.user_character import EMPTY, CharacterFolder
from posefield.common.errors import InvalidField
from posefield.http import metrics, responses
from posefield.http.access.access_control import AccessPolicy
from posefield.http.access.api_keys import Principal
from posefield.http.api.problems import (
    BAD_BODY,
    BODY_TOO_LARGE,
    DEADLINE_EXCEEDED,
    HEAD_TOO_LARGE,
    NOT_JSON,
    OVERLOADED,
    UNKNOWN_HOST,
    URL_TOO_LONG,
    RequestError,
)
from posefield.http.api.settings import Settings
from posefield.http.batching import ClipBatcher, PoseBatcher
from posefield.http.readiness import Readiness
from posefield.http.routing import Route
from posefield.http.static_page import StaticPage
from posefield.http.telemetry import LogBuffer
from posefield.question import json_decoding, text_decoding
from posefield.registry.model_registry import ModelRegistry
from posefield.synthesis.synthesizer import Synthesizer

LOOPBACK = ("localhost",)
"""Default of the accepted host names; IP addresses are always accepted."""
MAX_FIELDS = 100
"""Maximum number of header lines of a request; browsers send 20."""


@dataclass(frozen=True)
class HeadLimits:
    """Limits on request heads.

    url: maximum bytes of the path and query. headers: maximum bytes of all headers. names: accepted
    host names in lower case; a name with a leading dot matches as a suffix, "*" matches all.
    """

    url: int
    headers: int
    names: tuple[str, ...]
    _known: set[bytes] = field(default_factory=set)

    def check(self, scope: Scope) -> None:
        """Raise RequestError for a long URL (414), large headers (431) or an unknown host (421)."""
        # raw_path is optional in ASGI.
        path = scope.get("raw_path") or scope["path"].encode()
        if len(path) + len(scope["query_string"]) > self.url:
            raise RequestError(URL_TOO_LONG, f"expected at most {self.url} bytes")
        size, hosts, count = 0, [], 0
        for name, value in scope["headers"]:
            size += len(name) + len(value)
            count += 1
            if name == b"host":
                hosts.append(value)
        if size > self.headers or count > MAX_FIELDS:
            detail = f"expected at most {self.headers} bytes in at most {MAX_FIELDS} headers"
            raise RequestError(HEAD_TOO_LARGE, detail)
        # HTTP/1.0 has no Host; load balancers still use it for health checks.
        if len(hosts) > 1 or (not hosts and scope["http_version"] != "1.0"):
            raise RequestError(UNKNOWN_HOST, f"{len(hosts)} Host headers, expected one")
        if hosts and hosts[0] not in self._known:
            self._check_host(hosts[0])

    def _check_host(self, header: bytes) -> None:
        name = _without_port(header.decode("latin-1").lower())
        if not (_is_address(name) or any(_matches(name, pattern) for pattern in self.names)):
            patterns = (
                f"*{pattern}" if pattern.startswith(".") else pattern for pattern in self.names
            )
            expected = ", ".join(patterns)
            detail = f"{name[:100]!r}, expected an address or one of {expected} (POSEFIELD_HOSTS)"
            raise RequestError(UNKNOWN_HOST, detail)
        # Bounded: clients can make up any number of accepted Host values.
        if len(self._known) < 100:
            self._known.add(header)


def host_names(text: str, setting: str) -> tuple[str, ...]:
    """Return host names of a text with commas between, LOOPBACK for an empty one.

    `*.example.com` stands for all names below `example.com`, `*` for all names. Raises
    InvalidField, which names the setting, for a name with a port or a scheme.
    """
    names = [item.strip().lower() for item in text.split(",") if item.strip()]
    for name in names:
        if name != "*" and not _NAME.issuperset(name.removeprefix("*.")):
            raise InvalidField(setting, f"{name!r}, expected names as example.com, *.example.com")
    return tuple(name.removeprefix("*") if name != "*" else name for name in names) or LOOPBACK


_NAME = frozenset("abcdefghijklmnopqrstuvwxyz0123456789.-_")


def _matches(name: str, pattern: str) -> bool:
    return pattern in ("*", name) or (pattern.startswith(".") and name.endswith(pattern))


def _without_port(host: str) -> str:
    if host.startswith("["):
        return host[1:].partition("]")[0]
    return host.partition(":")[0].removesuffix(".")


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


MEDIA_TYPE = "application/json"

FREE_BYTES = 64 * 1024
"""Bytes of each body that do not count: the number of open requests bounds their memory, and small
requests succeed while large bodies exhaust the limit."""


@dataclass
class BodyMemory:
    """Memory of the bodies of open requests, beyond the first FREE_BYTES of each.

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
    body, counted = bytearray(), 0
    async for chunk in request.stream():
        body += chunk
        if len(body) > limit:
            raise _too_large(limit)
        if (beyond := len(body) - FREE_BYTES) > counted:
            memory.take(beyond - counted)
            request.scope["body_memory"] = counted = beyond
    if declared != len(body) and declared:
        # httptools skips the body of a request with an Upgrade to another protocol (h2c).
        detail = f"{len(body)} of {declared} bytes arrived; send HTTP/1.1 without `Upgrade`"
        raise RequestError(BAD_BODY, detail, {"pointer": ""}, _CLOSE)
    return bytes(body)


def _check_media_type(header: str) -> None:
    name, _, parameters = header.partition(";")
    charset = parameters.strip().lower()
    if name.strip().lower() != MEDIA_TYPE or charset not in ("", "charset=utf-8"):
        raise RequestError(NOT_JSON, f"Content-Type {header!r}, expected {MEDIA_TYPE!r}")


def _declared_length(request: Request) -> int:
    length = request.headers.get("content-length", "")
    return int(length) if length.isascii() and length.isdigit() and len(length) < 20 else 0


def _too_large(limit: int) -> RequestError:
    detail = f"more than {limit} bytes, expected at most {limit}"
    return RequestError(BODY_TOO_LARGE, detail, headers=_CLOSE)


# The client may still be sending the rest of the body: closing the connection stops it.
_CLOSE = {"Connection": "close"}


Result = TypeVar("Result")

CHECK_INTERVAL = 0.1
"""Seconds between two checks: a timer per request would take a tenth of a pose request's time."""


class DeadlineTimer:
    """Requests of an event loop with their deadlines."""

    def __init__(self) -> None:
        self._until: dict[Task[Any], float] = {}
        self._late: set[Task[Any]] = set()
        self._checking = False

    async def within(self, limit: float, answer: Awaitable[Result]) -> Result:
        """Await a response; raises RequestError 503 if it takes longer than `limit` seconds.

        The awaiting task is cancelled then, and `batching.run_in_thread` asks the thread's
        work to stop.
        """
        task, loop = asyncio.current_task(), asyncio.get_running_loop()
        assert task is not None
        self._until[task] = loop.time() + limit
        if not self._checking:
            self._checking = True
            loop.call_later(CHECK_INTERVAL, self._check)
        try:
            return await answer
        except asyncio.CancelledError:
            if task not in self._late:
                raise
            task.uncancel()
            detail = f"no answer within {limit:g} s"
            raise RequestError(DEADLINE_EXCEEDED, detail, headers={"Retry-After": "1"}) from None
        finally:
            del self._until[task]
            self._late.discard(task)

    def _check(self) -> None:
        loop = asyncio.get_running_loop()
        self._checking = bool(self._until)
        if self._checking:
            loop.call_later(CHECK_INTERVAL, self._check)
        now = loop.time()
        metrics.set_open_requests(len(self._until))
        late = [task for task, until in self._until.items() if until < now]
        for task in late:
            if task not in self._late:
                self._late.add(task)
                task.cancel()


@dataclass
class Service:
    """State that all requests share.

    contract: version of the contract. pages: by operationId. origins: for CORS. log: of requests;
    None for none. code: digest for entity tags. open: number of open requests.
    """

    head_limits: HeadLimits
    readiness: Readiness
    settings: Settings
    contract: str
    pages: Mapping[str, StaticPage]
    access_policy: AccessPolicy
    origins: frozenset[bytes]
    log: LogBuffer | None
    characters: CharacterFolder = EMPTY
    open: int = 0
    code: bytes = field(default_factory=responses.code_digest)
    pose_batcher: PoseBatcher = field(default_factory=PoseBatcher)
    clip_batcher: ClipBatcher = field(default_factory=ClipBatcher)
    deadlines: DeadlineTimer = field(default_factory=DeadlineTimer)
    bodies: BodyMemory = field(init=False)

    def __post_init__(self) -> None:
        self.bodies = BodyMemory(self.settings.bodies_memory)


_REQUEST_ID = re.compile(rb"[A-Za-z0-9._-]{1,64}")
# Process prefix and counter: a random number per request would take four times as long.
_PROCESS, _NUMBERS = os.urandom(12).hex(), count(1)
_ESCAPES = re.compile("[%+]")
Question = TypeVar("Question", bound=Struct)


class ServiceRequest(Request):
    """A request to the service, with the facts that the steps of `request_cycle` find.

    head: headers by name in lower case. identity: request id. library: models that the client may
    read. model: that of the path. format: extension; empty for an operation without formats.
    coding, tag, lifetime: content coding, entity tag and Cache-Control of the response. status,
    size: of the response as far as it was sent.
    """

    route: Route | None = None
    library: ModelRegistry
    principal: Principal | None = None
    model: Synthesizer
    format = ""
    coding: str | None = None
    tag: str | None = None
    lifetime = b""
    status = size = 0

    def __init__(self, service: Service, scope: Scope, receive: Receive, send: Send) -> None:
        super().__init__(scope, receive)
        self.start = time.perf_counter()
        self.service, self._transmit = service, send
        self.head: dict[bytes, bytes] = dict(scope["headers"])
        sent = self.head.get(b"x-request-id", b"")
        valid = _REQUEST_ID.fullmatch(sent)
        self.identity = sent.decode() if valid else f"{_PROCESS}{next(_NUMBERS):08x}"
        scope.setdefault("state", {})["request_id"] = self.identity

    async def decode(self, form: type[Question]) -> Question:
        """Return the question of the JSON body of a POST, of the query parameters otherwise.

        Raises the errors of `read_body`, `json_decoding` and `text_decoding.decode_question`.
        """
        if self.method != "POST":
            return text_decoding.decode_question(form, query_pairs(self.scope["query_string"]))
        service = self.service
        content = await read_body(self, service.settings.body_limit, service.bodies)
        return json_decoding.decode_question(form, content)

    async def transmit(self, message: Message) -> None:
        """Pass a message of the response on to the server, and note its status or size."""
        if message["type"] == "http.response.start":
            self.status = message["status"]
        else:
            self.size += len(message.get("body", b""))
        await self._transmit(message)


def query_pairs(query_string: bytes) -> list[tuple[str, str]]:
    """Return the decoded names and values of a query string."""
    text = query_string.decode("latin-1")
    if _ESCAPES.search(text):
        return parse_qsl(text, keep_blank_values=True)
    # Without escapes this gives the result of parse_qsl in a fifth of its time.
    pairs = []
    for parameter in text.split("&"):
        if parameter:
            name, _, value = parameter.partition("=")
            pairs.append((name, value))
    return pairs
