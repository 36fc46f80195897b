"""One request, from the server to its response: read this file first.

The steps, in their order: find the operation, authorise the client, negotiate the format,
revalidate the client's cached response, answer by the function of the operation, and send the
response. Authorisation comes before the operation, so that the body of a client without a key is
not read, and revalidation before it, so that a 304 costs no work.
"""

import logging
import re
import time
from collections.abc import Callable, Iterable
from contextlib import AbstractAsyncContextManager
from dataclasses import dataclass, field
from typing import Any

from starlette.requests import ClientDisconnect
from starlette.responses import Response
from starlette.types import Receive, Scope, Send

from posefield.common.errors import QueryError, UnknownFormat, did_you_mean
from posefield.http import metrics, negotiation, responses, telemetry
from posefield.http.access import access_control
from posefield.http.access.access_control import AuditedRequest
from posefield.http.access.api_keys import EVERYONE
from posefield.http.api import problems
from posefield.http.api.problems import METHOD_NOT_ALLOWED, OVERLOADED, RequestError
from posefield.http.request import Service, ServiceRequest
from posefield.http.routing import PathRoutes, Route

faults = logging.getLogger(__name__)

# RFC 7240, 4.3: time after which the client needs no response, s.
_WAIT = re.compile(rb"(?:^|[,;\s])wait\s*=\s*([0-9]{1,6})(?![0-9])", re.IGNORECASE)


class App:
    """ASGI application. lifespan: context of the server's background tasks."""

    def __init__(
        self,
        service: Service,
        routes: "RouteTree",
        lifespan: Callable[[Service], AbstractAsyncContextManager[None]],
    ) -> None:
        self.service = service
        self.routes = routes
        self._lifespan = lifespan

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "http":
            await handle(self.routes, ServiceRequest(self.service, scope, receive, send))
        elif scope["type"] == "lifespan":
            await receive()
            async with self._lifespan(self.service):
                await send({"type": "lifespan.startup.complete"})
                await receive()
            await send({"type": "lifespan.shutdown.complete"})


async def handle(routes: "RouteTree", request: ServiceRequest) -> None:
    """Send the response to a request, or that of its error, and record it."""
    service = request.service
    service.open += 1
    try:
        await send_response(request, await respond(routes, request))
    except ClientDisconnect:
        faults.info("request %s: the client went away", request.identity)
    except Exception:
        if request.status:
            faults.error("request %s failed, and its answer breaks off", request.identity)
            raise
        faults.exception("request %s failed", request.identity)
        request.coding = request.tag = None
        await send_response(request, problems.internal_error_response(request))
    finally:
        service.open -= 1
        if memory := request.scope.get("body_memory"):
            service.bodies.release(memory)
        record(request)


async def respond(routes: "RouteTree", request: ServiceRequest) -> Response:
    """Return the response of an operation, or that of an error."""
    service, scope = request.service, request.scope
    try:
        service.head_limits.check(scope)
        path = find_path(routes, scope)
        request.route = route = path.routes.get(scope["method"])
        if route is None:
            return other_method(request, path)
        if service.open > service.settings.concurrency and route.operation.sheddable:
            detail = f"{service.open - 1} requests are being answered"
            raise RequestError(OVERLOADED, detail, headers={"Retry-After": "1"})
        authorise(request, route)
        negotiate(request, route)
        if revalidate(request, route):
            return Response(status_code=304)
        limit = requested_deadline(request.head.get(b"prefer"), service.settings.deadline)
        return await service.deadlines.within(limit, route.handler(request))
    except RequestError as fault:
        return problems.request_error_response(request, fault)
    except QueryError as error:
        return problems.query_error_response(request, error)


def find_path(routes: "RouteTree", scope: Scope) -> PathRoutes:
    """Return the operations of a path, by method, and set the path's parameters.

    Raises UnknownFormat, and RequestError 404 for a path that is not in the contract.
    """
    path = scope["path"]
    match = routes.find(path)
    if match is not None:
        operations, scope["path_params"] = match
        return operations
    if formats := routes.other_formats(path):
        unknown, names = formats
        detail = f"no format {unknown!r}{did_you_mean(unknown, names)}"
        raise UnknownFormat("format", f"{detail}; there are {', '.join(names)}")
    raise RequestError(problems.NO_SUCH_PATH, f"{path!r}; /openapi.yaml names what there is")


def other_method(request: ServiceRequest, path: PathRoutes) -> Response:
    """Return the response to OPTIONS; raises RequestError 405 for other methods."""
    method, allow = request.scope["method"], {"Allow": path.allow}
    if method != "OPTIONS":
        detail = f"{method}, expected one of {path.allow}"
        raise RequestError(METHOD_NOT_ALLOWED, detail, headers=allow)
    response = Response(status_code=204, headers=allow)
    preflight = b"origin" in request.head and b"access-control-request-method" in request.head
    if request.service.origins and preflight:
        response.raw_headers += responses.preflight_headers(path.allow.encode())
    return response


def authorise(request: ServiceRequest, route: Route) -> None:
    """Set the request's principal and the library that it may read; raises RequestError."""
    scope, service = request.scope, request.service
    request.principal = EVERYONE
    # A reload can replace the registry: each request reads it once.
    request.library = registry = service.readiness.models.registry
    if service.access_policy.requires_credentials:
        call = AuditedRequest(request.identity, scope["method"], route.path)
        needed = route.operation.scope
        principal = access_control.authorize(service.access_policy, scope["headers"], needed, call)
        request.principal = principal
        if needed is not None:
            model = scope["path_params"].get("model")
            request.library = access_control.readable_library(registry, principal, model, call)


def negotiate(request: ServiceRequest, route: Route) -> None:
    """Set the response's format and content coding.

    Raises RequestError for an unknown query parameter and for formats that do not exist.
    """
    request.format = route.format
    if request.scope["query_string"] and not route.operation.open_query:
        _check_parameters(request, route.operation.query)
    if route.compresses and b"accept-encoding" in request.head:
        request.coding = negotiation.preferred_coding(request.head[b"accept-encoding"])
    if route.offers:
        request.format = negotiation.negotiated_format(request, route.offers)


def _check_parameters(request: ServiceRequest, parameters: frozenset[str]) -> None:
    if unknown := request.query_params.keys() - parameters:
        name = min(unknown)
        names = sorted(parameters)
        hint = did_you_mean(name, names)
        detail = f"{name}: no such query parameter{hint}; there are {names or 'none'}"
        raise RequestError(problems.BAD_PARAMETER, detail, {"parameter": name})


def revalidate(request: ServiceRequest, route: Route) -> bool:
    """Set the model, entity tag and lifetime; return whether the client has this response.

    Raises UnknownModel.
    """
    service, query, operation = request.service, request.scope["query_string"], route.operation
    key = request.scope["path_params"].get("model")
    if key:
        request.model = model = request.library.find(key)
        if not operation.pure:
            return False
        inputs = [service.code, model.fingerprint, route.name, query, request.format.encode(), b""]
        # A name may be escaped; few queries need parsing for it.
        if (b"character" in query or b"%" in query) and "character" in request.query_params:
            # The file of a character may change under the hash of a model too.
            key, inputs[-1] = key.partition("@")[0], service.characters.digest
        closed = service.access_policy.requires_credentials
        request.lifetime = responses.cache_control(key, service.settings.alias_seconds, closed)
    elif page := service.pages.get(operation.id):
        request.lifetime = responses.PUBLIC + responses.NO_CACHE
        inputs = [page.digest]
    else:
        return False
    request.tag = responses.entity_tag(*inputs, coding=request.coding)
    cached = request.head.get(b"if-none-match")
    return cached is not None and responses.matches_tag(cached.decode("latin-1"), request.tag)


def requested_deadline(prefer: bytes | None, longest: float) -> float:
    """Return the deadline of a request, s: `wait` of its Prefer header, at most `longest`."""
    wait = _WAIT.search(prefer) if prefer else None
    return min(longest, float(wait[1])) if wait else longest


async def send_response(request: ServiceRequest, response: Response) -> None:
    """Compress a response, add the common headers and send it.

    They are request id, security, connection, CORS and caching.
    """
    if request.coding is not None and response.status_code == 200:
        await negotiation.compress_response(response, request.coding)
    # A Content-Security-Policy with a 304 would replace that of the browser's cached page, which
    # could then load nothing.
    is_page = response.media_type == "text/html" or response.status_code == 304
    security = responses.PAGE_HEADERS if is_page else responses.DATA_HEADERS
    headers = [(b"x-request-id", request.identity.encode()), *security]
    if request.service.readiness.draining and "connection" not in response.headers:
        # The client's next request must reach a process that continues to run.
        headers.append((b"connection", b"close"))
    if origins := request.service.origins:
        headers += responses.cors_headers(request.head.get(b"origin"), origins)
    cacheable = response.status_code in (200, 304)
    if cacheable and request.route and request.route.vary:
        headers.append((b"vary", request.route.vary))
    if cacheable and request.tag:
        headers += [(b"etag", request.tag.encode()), (b"cache-control", request.lifetime)]
    elif "cache-control" not in response.headers:
        headers.append((b"cache-control", responses.NO_STORE))
    response.raw_headers += headers
    await response(request.scope, request.receive, request.transmit)


def record(request: ServiceRequest) -> None:
    """Record a request in the metrics, the log and the trace."""
    duration = time.perf_counter() - request.start
    operation = request.route.operation.id if request.route else "none"
    metrics.latency(operation, request.format, request.status).observe(duration)
    metrics.sent_bytes(operation, request.format).inc(request.size)
    if request.status == 304:
        metrics.not_modified(operation, request.format).inc()
    if request.service.log is not None:
        request.service.log.add(_log_line(request, operation, duration))


def _log_line(request: ServiceRequest, operation: str, duration: float) -> dict[str, Any]:
    model = getattr(request, "model", None)
    return {
        "time": telemetry.timestamp(time.time()),
        "request": request.identity,
        "trace": telemetry.trace_id(request.head),
        "method": request.scope["method"],
        "operation": operation,
        "format": request.format or None,
        "model": model.identity if model else None,
        "who": request.principal.name if request.principal else None,
        "tag": request.tag,
        "status": request.status,
        "bytes": request.size,
        "milliseconds": round(duration * 1e3, 3),
    }


@dataclass
class _TreeNode:
    """Node of the tree.

    fixed: children by segment. parameter: child of a path parameter, and `name` the parameter's
    name. routes: of the path that ends here.
    """

    fixed: dict[str, "_TreeNode"] = field(default_factory=dict)
    parameter: "_TreeNode | None" = None
    name: str = ""
    routes: PathRoutes | None = None


class RouteTree:
    """Routing table: a tree of path segments, with one look-up per segment.

    A path that ends in `{format}` has one entry per format, so that its look-up is as fast. paths:
    routes of each path.
    """

    def __init__(self, routes: Iterable[Route]) -> None:
        self._root = _TreeNode()
        by_path: dict[str, dict[str, Route]] = {}
        self._formats: dict[str, dict[str, None]] = {}
        for route in routes:
            by_path.setdefault(route.path, {})[route.operation.method] = route
            if route.format:
                stem = route.path.removesuffix(f".{route.format}")
                self._formats.setdefault(stem, {})[route.format] = None
        self.paths = [_path_routes(*item) for item in by_path.items()]
        for path in self.paths:
            node = self._root
            for segment in path.template.split("/"):
                node = _child_node(node, segment)
            node.routes = path

    def find(self, path: str) -> tuple[PathRoutes, dict[str, str]] | None:
        """Return the routes of a path and its non-empty path parameters; None if unknown."""
        node, values = self._root, {}
        for segment in path.split("/"):
            child = node.fixed.get(segment)
            if child is None and segment and node.parameter is not None:
                values[node.name] = segment
                child = node.parameter
            if child is None:
                return None
            node = child
        return (node.routes, values) if node.routes else None

    def other_formats(self, path: str) -> tuple[str, Iterable[str]] | None:
        """Return the unknown format that a path ends in and the known formats of that path."""
        unknown = path.rpartition("/")[2].partition(".")[2]
        stem = self.find(path.removesuffix(f".{unknown}"))
        formats = self._formats.get(stem[0].template) if stem else None
        return (unknown, formats) if unknown and formats else None


def _child_node(node: _TreeNode, segment: str) -> _TreeNode:
    if not segment.startswith("{"):
        return node.fixed.setdefault(segment, _TreeNode())
    if node.parameter is None:
        node.parameter, node.name = _TreeNode(), segment.strip("{}")
    if node.name != segment.strip("{}"):
        raise ValueError(f"{segment} and {{{node.name}}} at one place of the contract's paths")
    return node.parameter


def _path_routes(path: str, routes: dict[str, Route]) -> PathRoutes:
    methods = {**routes, "HEAD": routes["GET"]} if "GET" in routes else routes
    return PathRoutes(path, methods, ", ".join(sorted({*methods, "OPTIONS"})))
