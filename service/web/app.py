"""The application: the contract's operations as routes, and what surrounds every answer."""

import logging
import re
import uuid
from collections.abc import Mapping
from dataclasses import replace

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
from service.web import browser, contract, cors, problems, protocol
from service.web.access import door, policy
from service.web.access.audit import Call
from service.web.access.policy import Policy
from service.web.contract import Contract, Operation
from service.web.operations import OPERATIONS, Handler, Service
from service.web.problems import RequestFault
from service.web.settings import PREFIX, Settings

log = logging.getLogger(__name__)

REQUEST_ID = re.compile(r"[A-Za-z0-9._-]{1,64}")
FORMAT_PATH = re.compile(r"/v1/models/[^/]+/(clip|clips|crowd)\.([^/]+)")
FORMATS = {
    "clip": [*ENCODERS],
    "clips": [*PACKS],
    "crowd": [*CROWD_ENCODERS, *crowd.STREAMS],
}


def create_app(library: Library, settings: Settings) -> Starlette:
    """Application that answers for the models of a library; raises as `build` does."""
    return build(contract.load(), OPERATIONS, library, settings)


def build(
    agreed: Contract, handlers: Mapping[str, Handler], library: Library, settings: Settings
) -> Starlette:
    """Application of a contract and the handlers of its operations.

    Raises ValueError for an operation without a handler and a handler without an operation, and
    InvalidField or FileError for settings that would let in whom they should not, or nobody.
    """
    _check_complete({operation.id for operation in agreed.operations}, set(handlers))
    rules = policy.of(settings)
    policy.check_exposure(settings, rules)
    service = Service(library, settings, agreed.source)
    paths = dict.fromkeys(operation.path for operation in agreed.operations)
    app = Starlette(
        routes=[_route(path, agreed, handlers, service, rules) for path in paths],
        middleware=[Middleware(Envelope, origins=cors.read(settings.origins, f"{PREFIX}ORIGINS"))],
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


def _route(
    path: str,
    agreed: Contract,
    handlers: Mapping[str, Handler],
    service: Service,
    rules: Policy,
) -> Route:
    """Route of all methods of a path, so that a 405 names them all."""
    by_method = {o.method: o for o in agreed.operations if o.path == path}

    async def endpoint(request: Request) -> Response:
        operation = by_method["GET" if request.method == "HEAD" else request.method]
        seen = _let_in(operation, service, rules, request)
        _check_parameters(operation, request)
        return await handlers[operation.id](seen, request)

    return Route(path, endpoint, methods=list(by_method))


def _let_in(operation: Operation, service: Service, rules: Policy, request: Request) -> Service:
    """The service as whoever asks may see it; raises RequestFault 401 or 403."""
    scope = request.scope
    call = Call(scope["state"]["request_id"], request.method, operation.path)
    known = scope["principal"] = door.check(rules, scope["headers"], operation.scope, call)
    if operation.scope is None or known.models is None:
        return service
    asked = request.path_params.get("model")
    return replace(service, library=door.seen(service.library, known, asked, call))


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
        if request.method == "OPTIONS" and cors.is_preflight(request.scope["headers"]):
            response = Response(status_code=204, headers={"Allow": allow})
            response.raw_headers += cors.preflight(allow.encode())
            return response
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

    def __init__(self, app: ASGIApp, origins: frozenset[bytes]) -> None:
        self.app = app
        self.origins = origins

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        identity = _request_id(scope)
        scope.setdefault("state", {})["request_id"] = identity
        started, headers_given = False, dict(scope["headers"])

        async def sealed(message: Message) -> None:
            nonlocal started
            if message["type"] == "http.response.start":
                started = True
                headers = MutableHeaders(scope=message)
                headers["X-Request-Id"] = identity
                message["headers"] += browser.common({name for name, _ in message["headers"]})
                message["headers"] += cors.headers(headers_given.get(b"origin"), self.origins)
            await send(message)

        try:
            if protocol.FAULT in scope:
                refusal = await problems.of_fault(Request(scope), scope[protocol.FAULT])
                await refusal(scope, receive, sealed)
                return
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
