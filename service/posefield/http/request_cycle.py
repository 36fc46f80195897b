"""One request, from the server to its response: read this file first.

The steps, in their order: find the operation, authorise the client, negotiate the format,
revalidate the client's cached response, decode the question, validate it, synthesise the answer,
encode it, and send the response. Authorisation comes before decoding, so that the body of a client
without a key is not read, and revalidation before it, so that a 304 costs no work.
"""

import asyncio
import logging
import os
import re
import time
from asyncio import Task
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from itertools import count
from typing import Any, TypeVar

from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response
from starlette.types import Message, Receive, Scope, Send

from posefield.common.errors import QueryError, did_you_mean
from posefield.http import header_fields, metrics, negotiation, telemetry
from posefield.http.access import access_control
from posefield.http.access.access_control import AuditedRequest
from posefield.http.access.api_keys import EVERYONE
from posefield.http.api import problems
from posefield.http.api.contract import Operation
from posefield.http.api.problems import (
    DEADLINE_EXCEEDED,
    METHOD_NOT_ALLOWED,
    OVERLOADED,
    RequestError,
)
from posefield.http.header_fields import HeadLimits
from posefield.http.routing import PathRoutes, Route, RouteTree
from posefield.http.steps import Context, Handler, Service, Steps
from posefield.http.telemetry import trace_id

faults = logging.getLogger(__name__)

REQUEST_ID = re.compile(rb"[A-Za-z0-9._-]{1,64}")
# Process prefix and counter: a random number per request would take four times as long.
_PROCESS, _NUMBERS = os.urandom(12).hex(), count(1)


Result = TypeVar("Result")

CHECK_INTERVAL = 0.1
"""Seconds between two checks: a timer per request would take a tenth of a pose request's time."""

# RFC 7240, 4.3: time after which the client needs no response, s.
_WAIT = re.compile(rb"(?:^|[,;\s])wait\s*=\s*([0-9]{1,6})(?![0-9])", re.IGNORECASE)


def requested_deadline(prefer: bytes | None, most: float) -> float:
    """Return the deadline of a request, s: `wait` of its Prefer header, at most `most`."""
    found = _WAIT.search(prefer) if prefer else None
    return min(most, float(found[1])) if found else most


class DeadlineTimer:
    """Requests of an event loop with their deadlines."""

    def __init__(self) -> None:
        self._until: dict[Task[Any], float] = {}
        self._late: set[Task[Any]] = set()
        self._checking = False

    async def within(self, limit: float, answer: Awaitable[Result]) -> Result:
        """Await a response; raises RequestError 503 if it takes longer than `limit` seconds.

        The awaiting task is cancelled then, and `worker_threads.run_in_thread` asks the thread's
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
class ServerState:
    """State that all requests share.

    places: routes by path. service: state that handlers share. missing: returns the error of an
    unknown path. head_limits: limits on request heads. open: number of open requests. watch:
    deadlines.
    """

    places: RouteTree
    service: Service
    missing: Callable[[str], Exception]
    head_limits: HeadLimits
    open: int = 0
    watch: DeadlineTimer = field(default_factory=DeadlineTimer)


class Exchange:
    """State of one request and its response, for the common headers and for telemetry."""

    def __init__(self, site: ServerState, scope: Scope, receive: Receive, send: Send) -> None:
        self.begun = time.perf_counter()
        self.site, self.service, self.scope, self._send = site, site.service, scope, send
        self.headers: dict[bytes, bytes] = dict(scope["headers"])
        self.identity = _request_id(self.headers)
        scope.setdefault("state", {})["request_id"] = self.identity
        self.request = Request(scope, receive)
        self.route: Route | None = None
        self.coding: str | None = None
        self.tag: str | None = None
        self.lifetime = b""
        self.status = self.size = 0

    async def sent(self, message: Message) -> None:
        """Pass a message on to the server, and note its status or size."""
        if message["type"] == "http.response.start":
            self.status = message["status"]
        else:
            self.size += len(message.get("body", b""))
        await self._send(message)


async def handle(site: ServerState, scope: Scope, receive: Receive, send: Send) -> None:
    """Send the response to a request, or that of its error, and record it."""
    exchange = Exchange(site, scope, receive, send)
    site.open += 1
    try:
        await send_response(exchange, await respond(exchange))
    except ClientDisconnect:
        faults.info("request %s: the client went away", exchange.identity)
    except Exception:
        if exchange.status:
            faults.error("request %s failed, and its answer breaks off", exchange.identity)
            raise
        faults.exception("request %s failed", exchange.identity)
        exchange.coding = exchange.tag = None
        await send_response(exchange, problems.internal_error_response(exchange.request))
    finally:
        site.open -= 1
        site.service.bodies.release(scope.get("body_memory", 0))
        record(exchange)


async def respond(exchange: Exchange) -> Response:
    """Return the response of an operation, or that of an error."""
    try:
        return await _respond(exchange)
    except RequestError as fault:
        return problems.request_error_response(exchange.request, fault)
    except QueryError as error:
        return problems.query_error_response(exchange.request, error)
    except header_fields.NotModified:
        return Response(status_code=304)


async def _respond(exchange: Exchange) -> Response:
    site, scope = exchange.site, exchange.scope
    site.head_limits.check(scope)
    place = find(site, scope)
    route = place.routes.get(scope["method"])
    if route is None:
        return other_method(exchange, place)
    exchange.route = route
    check_load(site, route.operation)
    authorise(exchange, route)
    negotiate(exchange, route)
    revalidate(exchange, route)
    limit = requested_deadline(exchange.headers.get(b"prefer"), site.service.settings.deadline)
    return await site.watch.within(limit, answer(route.handler, site.service, exchange.request))


def find(site: ServerState, scope: Scope) -> PathRoutes:
    """Return the operations of a path, by method, and set the path's parameters.

    Raises the error of an unknown path.
    """
    found = site.places.find(scope["path"])
    if found is None:
        raise site.missing(scope["path"])
    place, scope["path_params"] = found
    return place


def other_method(exchange: Exchange, place: PathRoutes) -> Response:
    """Return the response to OPTIONS; raises RequestError 405 for other methods."""
    method, allow = exchange.scope["method"], {"Allow": place.allow}
    if method != "OPTIONS":
        detail = f"{method}, expected one of {place.allow}"
        raise RequestError(METHOD_NOT_ALLOWED, detail, headers=allow)
    response = Response(status_code=204, headers=allow)
    if exchange.service.origins and header_fields.is_preflight(exchange.headers):
        response.raw_headers += header_fields.preflight_headers(place.allow.encode())
    return response


def check_load(site: ServerState, operation: Operation) -> None:
    """Raise RequestError 503 if too many requests are open for an operation that may wait."""
    if site.open > site.service.settings.concurrency and operation.sheddable:
        detail = f"{site.open - 1} requests are being answered"
        raise RequestError(OVERLOADED, detail, headers={"Retry-After": "1"})


def authorise(exchange: Exchange, route: Route) -> None:
    """Set the request's principal and the library that it may read; raises RequestError."""
    scope, service = exchange.scope, exchange.service
    scope["library"], scope["principal"] = service.registry, EVERYONE
    if service.access_policy.requires_credentials:
        call = AuditedRequest(exchange.identity, scope["method"], route.path)
        needed = route.operation.scope
        known = access_control.authorize(service.access_policy, scope["headers"], needed, call)
        scope["principal"] = known
        if needed is not None:
            asked = scope["path_params"].get("model")
            scope["library"] = access_control.readable_library(service.registry, known, asked, call)


def negotiate(exchange: Exchange, route: Route) -> None:
    """Set the response's format and content coding.

    Raises RequestError for an unknown query parameter and for formats that do not exist.
    """
    scope = exchange.scope
    scope["format"] = route.format
    if scope["query_string"] and not route.operation.open_query:
        _check_parameters(exchange.request, route.operation)
    if route.compresses and b"accept-encoding" in exchange.headers:
        exchange.coding = negotiation.preferred_coding(exchange.headers[b"accept-encoding"])
    if route.offers:
        scope["format"] = negotiation.negotiated_format(exchange.request, route.offers)


def _check_parameters(request: Request, operation: Operation) -> None:
    if unknown := request.query_params.keys() - operation.query:
        name = min(unknown)
        known = sorted(operation.query)
        hint = did_you_mean(name, known)
        detail = f"{name}: no such query parameter{hint}; there are {known or 'none'}"
        raise RequestError(problems.BAD_PARAMETER, detail, {"parameter": name})


def revalidate(exchange: Exchange, route: Route) -> None:
    """Set the model, the entity tag and the lifetime of the response.

    Raises UnknownModel, and NotModified if the client has a response with this tag.
    """
    scope, service, operation = exchange.scope, exchange.service, route.operation
    if key := scope["path_params"].get("model"):
        scope["model"] = model = scope["library"].find(key)
        if operation.pure:
            delivered = _names_character(exchange)
            # The file of a character may change under the hash of a model too.
            exchange.lifetime = service.lifetime(key.partition("@")[0] if delivered else key)
            chosen = (scope["format"] or "").encode()
            whom = service.characters.digest if delivered else b""
            parts = model.fingerprint, route.name, scope["query_string"], chosen, whom
            _check_tag(exchange, service.code, *parts)
    elif page := service.pages.get(operation.id):
        exchange.lifetime = header_fields.PUBLIC + header_fields.NO_CACHE
        _check_tag(exchange, page.digest)


def _names_character(exchange: Exchange) -> bool:
    """Return whether the query has the parameter `character`; few queries need parsing for it."""
    query = exchange.scope["query_string"]
    # A name may be escaped.
    return (b"character" in query or b"%" in query) and (
        "character" in exchange.request.query_params
    )


def _check_tag(exchange: Exchange, *parts: bytes) -> None:
    """Set the entity tag of a response that depends on these parts alone."""
    exchange.tag = header_fields.entity_tag(*parts, coding=exchange.coding)
    given = exchange.headers.get(b"if-none-match")
    if given is not None and header_fields.matches_tag(given.decode("latin-1"), exchange.tag):
        raise header_fields.NotModified


async def answer(handler: Handler, service: Service, request: Request) -> Response:
    """Return the response of an operation, whose question is decoded and answered in steps."""
    if not isinstance(handler, Steps):
        return await handler(service, request)
    scope = request.scope
    form = handler.formats.get(scope["format"])
    context = Context(service, scope["library"], scope.get("model"), form)
    question = await handler.decode(context, request)
    task = await handler.validate(context, question)
    async with handler.places(context, task):
        found = await handler.synthesise(context, task)
        content = await handler.encode(context, task, found)
    return handler.respond(context, found, content)


async def send_response(exchange: Exchange, response: Response) -> None:
    """Compress a response, add the common headers and send it."""
    if exchange.coding is not None and response.status_code == 200:
        await negotiation.compress_response(response, exchange.coding)
    response.raw_headers += _common_headers(exchange, response)
    await response(exchange.scope, exchange.request.receive, exchange.sent)


def _common_headers(exchange: Exchange, response: Response) -> list[tuple[bytes, bytes]]:
    """Return the headers of every response: request id, security, connection, CORS and caching."""
    kind = header_fields.security_headers(response.media_type, response.status_code)
    headers = [(b"x-request-id", exchange.identity.encode()), *kind]
    if exchange.service.readiness.draining and "connection" not in response.headers:
        # The client's next request must reach a process that continues to run.
        headers.append((b"connection", b"close"))
    if origins := exchange.service.origins:
        headers += header_fields.cors_headers(exchange.headers.get(b"origin"), origins)
    held = response.status_code in (200, 304)
    if held and exchange.route and exchange.route.vary:
        headers.append((b"vary", exchange.route.vary))
    if held and exchange.tag:
        tag = exchange.tag.encode()
        headers += [(b"etag", tag), (b"cache-control", exchange.lifetime)]
    elif "cache-control" not in response.headers:
        headers.append((b"cache-control", header_fields.NO_STORE))
    return headers


def record(exchange: Exchange) -> None:
    """Record a request in the metrics, the log and the trace."""
    took = time.perf_counter() - exchange.begun
    operation = exchange.route.operation.id if exchange.route else "none"
    form = exchange.scope.get("format")
    metrics.count_request(operation, form or "", exchange.status, took, exchange.size)
    if exchange.service.log is not None:
        exchange.service.log.add(_log_line(exchange, operation, took))


def _log_line(exchange: Exchange, operation: str, took: float) -> dict[str, Any]:
    scope = exchange.scope
    model = scope.get("model")
    return {
        "time": telemetry.timestamp(time.time()),
        "request": exchange.identity,
        "trace": trace_id(exchange.headers),
        "method": scope["method"],
        "operation": operation,
        "format": scope.get("format"),
        "model": model.identity if model else None,
        "who": scope["principal"].name if "principal" in scope else None,
        "tag": exchange.tag,
        "status": exchange.status,
        "bytes": exchange.size,
        "milliseconds": round(took * 1e3, 3),
    }


def _request_id(headers: dict[bytes, bytes]) -> str:
    given = headers.get(b"x-request-id", b"")
    known = REQUEST_ID.fullmatch(given)
    return given.decode() if known else f"{_PROCESS}{next(_NUMBERS):08x}"
