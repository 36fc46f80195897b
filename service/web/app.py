"""The application: the contract's operations as routes, and what surrounds every answer."""

import logging
import re
import uuid
from collections.abc import Mapping

from starlette.applications import Starlette
from starlette.datastructures import Headers, MutableHeaders
from starlette.exceptions import HTTPException
from starlette.middleware import Middleware
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response
from starlette.routing import Route
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.encode import CROWD_ENCODERS, ENCODERS, crowd
from service.encode.packs import PACKS
from service.motion.errors import UnknownFormat
from service.synthesis.library import Library
from service.web import contract, problems
from service.web.contract import Contract, Operation
from service.web.operations import OPERATIONS
from service.web.problems import RequestFault
from service.web.service import Handler, Service
from service.web.settings import Settings

log = logging.getLogger(__name__)

REQUEST_ID = re.compile(r"[A-Za-z0-9._-]{1,64}")
FORMAT_PATH = re.compile(r"/v1/models/[^/]+/(clip|clips|crowd)\.([^/]+)")
FORMATS = {
    "clip": [*ENCODERS],
    "clips": [*PACKS],
    "crowd": [*CROWD_ENCODERS, *crowd.STREAMS],
}


def create_app(library: Library, settings: Settings) -> Starlette:
    """Application that answers for the models of a library."""
    return build(contract.load(), OPERATIONS, library, settings)


def build(
    agreed: Contract, handlers: Mapping[str, Handler], library: Library, settings: Settings
) -> Starlette:
    """Application of a contract and the handlers of its operations.

    Raises ValueError for an operation without a handler and a handler without an operation.
    """
    _check_complete({operation.id for operation in agreed.operations}, set(handlers))
    service = Service(library, settings, agreed.source)
    paths = dict.fromkeys(operation.path for operation in agreed.operations)
    app = Starlette(
        routes=[_route(path, agreed, handlers, service) for path in paths],
        middleware=[Middleware(Envelope)],
        exception_handlers={
            HTTPException: _of_routing,
            RequestFault: problems.of_fault,
            **dict.fromkeys(problems.TABLE, problems.of_query_error),
        },
    )
    # A path with a slash too many is another path: redirects are not in the contract.
    app.router.redirect_slashes = False
    return app


def _check_complete(agreed: set[str], handled: set[str]) -> None:
    if agreed != handled:
        raise ValueError(
            f"operations without a handler {sorted(agreed - handled)}, "
            f"handlers without an operation {sorted(handled - agreed)}"
        )


def _route(path: str, agreed: Contract, handlers: Mapping[str, Handler], service: Service) -> Route:
    """Route of all methods of a path, so that a 405 names them all."""
    by_method = {o.method: o for o in agreed.operations if o.path == path}

    async def endpoint(request: Request) -> Response:
        operation = by_method["GET" if request.method == "HEAD" else request.method]
        _check_parameters(operation, request)
        return await handlers[operation.id](service, request)

    return Route(path, endpoint, methods=list(by_method))


def _check_parameters(operation: Operation, request: Request) -> None:
    unknown = request.query_params.keys() - operation.query
    if unknown and not operation.open_query:
        name = min(unknown)
        detail = f"{name}: no such query parameter; there are {sorted(operation.query) or 'none'}"
        raise RequestFault(problems.BAD_PARAMETER, detail, {"parameter": name})


async def _of_routing(request: Request, fault: Exception) -> Response:
    """Answer to a path or method that the contract does not have."""
    assert isinstance(fault, HTTPException)
    # Not request.url: that is made of the Host header, which may be anything.
    path = request.scope["path"]
    if fault.status_code == problems.METHOD_NOT_ALLOWED.status:
        allow = ", ".join(sorted((fault.headers or {})["Allow"].split(", ")))
        detail = f"{request.method}, expected one of {allow}"
        refusal = RequestFault(problems.METHOD_NOT_ALLOWED, detail, headers={"Allow": allow})
        return await problems.of_fault(request, refusal)
    if asked := FORMAT_PATH.fullmatch(path):
        message = f"no format {asked[2]!r}; there are {', '.join(FORMATS[asked[1]])}"
        return await problems.of_query_error(request, UnknownFormat("format", message))
    refusal = RequestFault(problems.NO_SUCH_PATH, f"{path!r}; /openapi.yaml names what there is")
    return await problems.of_fault(request, refusal)


class Envelope:
    """Gives every request an id, every answer its common headers and every failure one shape."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        identity = _request_id(scope)
        scope.setdefault("state", {})["request_id"] = identity
        started = False

        async def sealed(message: Message) -> None:
            nonlocal started
            if message["type"] == "http.response.start":
                started = True
                headers = MutableHeaders(scope=message)
                headers["X-Request-Id"] = identity
                headers["X-Content-Type-Options"] = "nosniff"
            await send(message)

        try:
            await self.app(scope, receive, sealed)
        except ClientDisconnect:
            log.info("request %s: the client went away", identity)
        except Exception:
            if started:
                log.error("request %s failed, and its answer breaks off", identity)
                raise
            log.exception("request %s failed", identity)
            await problems.internal(Request(scope))(scope, receive, sealed)


def _request_id(scope: Scope) -> str:
    given = Headers(scope=scope).get("x-request-id", "")
    return given if REQUEST_ID.fullmatch(given) else uuid.uuid4().hex
