"""Processing of one request: checks, operation, errors, common headers and telemetry."""

import logging
import os
import re
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import count
from typing import Any

from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response
from starlette.types import Message, Receive, Scope, Send

from posefield.common.errors import QueryError
from posefield.http.access import access_control
from posefield.http.access.audit import Call
from posefield.http.access.principal import EVERYONE
from posefield.http.api import problems
from posefield.http.api.contract import Operation
from posefield.http.api.problems import METHOD_NOT_ALLOWED, OVERLOADED, RequestFault
from posefield.http.middleware import (
    caching,
    compression,
    cors,
    deadline,
    negotiation,
    security_headers,
)
from posefield.http.middleware.deadline import Watch
from posefield.http.middleware.request_head import HeadLimits
from posefield.http.routing import Map, Place, Route
from posefield.http.service import Service
from posefield.http.telemetry import log, metrics
from posefield.http.telemetry.telemetry import trace

faults = logging.getLogger(__name__)

REQUEST_ID = re.compile(rb"[A-Za-z0-9._-]{1,64}")
# Process prefix and counter: a random number per request would take four times as long.
_PROCESS, _NUMBERS = os.urandom(12).hex(), count(1)


@dataclass
class Site:
    """State that all requests share.

    places: routes by path. service: state that handlers share. missing: returns the error of an
    unknown path. head_limits: limits on request heads. open: number of open requests. watch:
    deadlines.
    """

    places: Map
    service: Service
    missing: Callable[[str], Exception]
    head_limits: HeadLimits
    open: int = 0
    watch: Watch = field(default_factory=Watch)


class Exchange:
    """One request, its response in progress and its facts for telemetry."""

    def __init__(self, site: Site, scope: Scope, receive: Receive, send: Send) -> None:
        self._begun = time.perf_counter()
        self._site, self._scope, self._send = site, scope, send
        self._headers: dict[bytes, bytes] = dict(scope["headers"])
        self._identity = _request_id(self._headers)
        scope.setdefault("state", {})["request_id"] = self._identity
        self._request = Request(scope, receive)
        self._route: Route | None = None
        self._coding: str | None = None
        self._tag: str | None = None
        self._lifetime = b""
        self._status = self._size = 0
        self._span = site.service.telling.begin(self._headers)

    async def run(self) -> None:
        """Send the response, or that of the error, and record the request."""
        self._site.open += 1
        try:
            await self._finish(await self._response())
        except ClientDisconnect:
            faults.info("request %s: the client went away", self._identity)
        except Exception:
            if self._status:
                faults.error("request %s failed, and its answer breaks off", self._identity)
                raise
            await self._fail()
        finally:
            self._site.open -= 1
            self._site.service.bodies.release(self._scope.get("body_memory", 0))
            self._note()

    async def _fail(self) -> None:
        faults.exception("request %s failed", self._identity)
        self._coding = self._tag = None
        await self._finish(problems.internal(self._request))

    async def _response(self) -> Response:
        try:
            return await self._answer()
        except RequestFault as fault:
            return problems.of_fault(self._request, fault)
        except QueryError as error:
            return problems.of_query_error(self._request, error)
        except caching.NotModified:
            return Response(status_code=304)

    async def _answer(self) -> Response:
        site, scope = self._site, self._scope
        site.head_limits.check(scope)
        found = site.places.find(scope["path"])
        if found is None:
            raise site.missing(scope["path"])
        place, scope["path_params"] = found
        route = place.routes.get(scope["method"])
        if route is None:
            return self._other_method(place)
        self._route, scope["format"] = route, route.format
        self._prepare(route)
        limit = deadline.seconds(self._headers.get(b"prefer"), site.service.settings.deadline)
        return await site.watch.within(limit, route.endpoint(self._request))

    def _other_method(self, place: Place) -> Response:
        """Return the response to OPTIONS; raises RequestFault 405 for other methods."""
        method, allow = self._scope["method"], {"Allow": place.allow}
        if method != "OPTIONS":
            detail = f"{method}, expected one of {place.allow}"
            raise RequestFault(METHOD_NOT_ALLOWED, detail, headers=allow)
        response = Response(status_code=204, headers=allow)
        if self._site.service.origins and cors.is_preflight(self._headers):
            response.raw_headers += cors.preflight(place.allow.encode())
        return response

    def _prepare(self, route: Route) -> None:
        """Check overload, access, query parameters, format, model and the client's cached response.

        Raises RequestFault, QueryError for an unknown model, and NotModified.
        """
        operation, site, scope = route.operation, self._site, self._scope
        if site.open > site.service.settings.concurrency and operation.sheds:
            detail = f"{site.open - 1} requests are being answered"
            raise RequestFault(OVERLOADED, detail, headers={"Retry-After": "1"})
        self._let_in(route)
        if scope["query_string"] and not operation.open_query:
            _check_parameters(self._request, operation)
        if route.compresses and b"accept-encoding" in self._headers:
            self._coding = compression.preferred(self._headers[b"accept-encoding"])
        if route.offers:
            scope["format"] = negotiation.format_of(self._request, route.offers)
        if "model" in scope["path_params"]:
            key = scope["path_params"]["model"]
            scope["model"] = scope["library"].find(key)
            if operation.pure:
                self._lifetime = site.service.lifetime(key)
                self._check_held(*self._parts(route))
        elif page := site.service.pages.get(operation.id):
            self._lifetime = caching.PUBLIC + caching.AGAIN
            self._check_held(page.digest)

    def _let_in(self, route: Route) -> None:
        """Set the request's principal and the library that it may read; raises RequestFault."""
        scope, service = self._scope, self._site.service
        scope["library"], scope["principal"] = service.library, EVERYONE
        if service.rules.closed:
            call, needed = Call(self._identity, scope["method"], route.path), route.operation.scope
            known = access_control.check(service.rules, scope["headers"], needed, call)
            scope["principal"] = known
            if needed is not None:
                asked = scope["path_params"].get("model")
                scope["library"] = access_control.seen(service.library, known, asked, call)

    def _parts(self, route: Route) -> tuple[bytes, ...]:
        """Return all that the response of a pure operation depends on."""
        scope, chosen = self._scope, (self._scope["format"] or "").encode()
        model, code = scope["model"], self._site.service.code
        return code, model.fingerprint, route.name, scope["query_string"], chosen

    def _check_held(self, *parts: bytes) -> None:
        """Set the entity tag; raises NotModified if the client has a response with this tag."""
        self._tag = caching.tag(*parts, coding=self._coding)
        given = self._headers.get(b"if-none-match")
        if given is not None and caching.held(given.decode("latin-1"), self._tag):
            raise caching.NotModified

    async def _finish(self, response: Response) -> None:
        if self._coding is not None and response.status_code == 200:
            await compression.apply(response, self._coding)
        response.raw_headers += self._surrounding(response)
        await response(self._scope, self._request.receive, self._sent)

    def _surrounding(self, response: Response) -> list[tuple[bytes, bytes]]:
        """Return the common headers: request id, security, connection, CORS and caching."""
        kind = security_headers.of(response.media_type, response.status_code)
        headers = [(b"x-request-id", self._identity.encode()), *kind]
        if self._site.service.readiness.draining and "connection" not in response.headers:
            # The client's next request must reach a process that continues to run.
            headers.append((b"connection", b"close"))
        if origins := self._site.service.origins:
            headers += cors.headers(self._headers.get(b"origin"), origins)
        held = response.status_code in (200, 304)
        if held and self._route and self._route.vary:
            headers.append((b"vary", self._route.vary))
        if held and self._tag:
            headers += [(b"etag", self._tag.encode()), (b"cache-control", self._lifetime)]
        elif "cache-control" not in response.headers:
            headers.append((b"cache-control", caching.ALWAYS_NEW))
        return headers

    async def _sent(self, message: Message) -> None:
        if message["type"] == "http.response.start":
            self._status = message["status"]
        else:
            self._size += len(message.get("body", b""))
        await self._send(message)

    def _note(self) -> None:
        """Record the request in the metrics, the log and the trace."""
        took = time.perf_counter() - self._begun
        operation = self._route.operation.id if self._route else "none"
        form = self._scope.get("format")
        metrics.answered(operation, form or "", self._status, took, self._size)
        telling = self._site.service.telling
        if telling.wanted:
            telling.end(self._span, self._line(operation, took))

    def _line(self, operation: str, took: float) -> dict[str, Any]:
        model = self._scope.get("model")
        return {
            "time": log.moment(time.time()),
            "request": self._identity,
            "trace": trace(self._headers),
            "method": self._scope["method"],
            "operation": operation,
            "format": self._scope.get("format"),
            "model": model.identity if model else None,
            "who": self._scope["principal"].name if "principal" in self._scope else None,
            "tag": self._tag,
            "status": self._status,
            "bytes": self._size,
            "milliseconds": round(took * 1e3, 3),
        }


def _request_id(headers: dict[bytes, bytes]) -> str:
    given = headers.get(b"x-request-id", b"")
    known = REQUEST_ID.fullmatch(given)
    return given.decode() if known else f"{_PROCESS}{next(_NUMBERS):08x}"


def _check_parameters(request: Request, operation: Operation) -> None:
    if unknown := request.query_params.keys() - operation.query:
        name = min(unknown)
        detail = f"{name}: no such query parameter; there are {sorted(operation.query) or 'none'}"
        raise RequestFault(problems.BAD_PARAMETER, detail, {"parameter": name})
