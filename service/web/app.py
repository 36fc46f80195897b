"""The application: the contract's operations at their paths, as ASGI."""

import re
from collections.abc import Mapping
from functools import partial

from starlette.types import Receive, Scope, Send

from service.encode import CROWD_ENCODERS, ENCODERS, POSE_ENCODERS, crowd
from service.encode.grids import GRID_ENCODERS
from service.encode.packs import PACKS
from service.motion.errors import UnknownFormat
from service.synthesis.library import Library
from service.synthesis.shelf import Fixed
from service.web import contract, cors, pages, problems
from service.web.access import policy
from service.web.contract import Contract, Operation
from service.web.exchange import Exchange, Site
from service.web.negotiation import Negotiated
from service.web.operations import OPERATIONS
from service.web.problems import RequestFault
from service.web.readiness import Readiness
from service.web.routing import Map, Route
from service.web.service import Handler, Service
from service.web.settings import PREFIX, Settings
from service.web.telling import SILENT, Telling

FORMAT_PATH = re.compile(r"/v1/models/[^/]+/(pose|clip|clips|crowd|sigma)\.([^/]+)")
FORMATS = {
    "pose": [*POSE_ENCODERS],
    "clip": [*ENCODERS],
    "clips": [*PACKS],
    "crowd": [*CROWD_ENCODERS, *crowd.STREAMS],
    "sigma": [*GRID_ENCODERS],
}


def create_app(models: Library | Readiness, settings: Settings, telling: Telling = SILENT) -> "App":
    """Application that answers for the models of a library, or for those of a shelf, that may be
    told to turn requests away; telling: where it tells of requests."""
    return build(contract.load(), OPERATIONS, models, settings, telling)


def build(
    agreed: Contract,
    handlers: Mapping[str, Handler],
    models: Library | Readiness,
    settings: Settings,
    telling: Telling = SILENT,
) -> "App":
    """Application of a contract and the handlers of its operations.

    Raises ValueError for an operation without a handler and a handler without an operation, and
    InvalidField or FileError for settings that would let in whom they should not, or nobody.
    """
    _check_complete({operation.id for operation in agreed.operations}, set(handlers))
    readiness = Readiness(Fixed(models)) if isinstance(models, Library) else models
    rules = policy.of(settings)
    policy.check_exposure(settings, rules)
    origins = cors.read(settings.origins, f"{PREFIX}ORIGINS")
    service = Service(
        readiness, settings, agreed.version, pages.made(agreed), rules, origins, telling
    )
    routes = [_route(operation, handlers[operation.id], service) for operation in agreed.operations]
    return App(Site(Map(routes), service, _missing))


def _route(operation: Operation, handler: Handler, service: Service) -> Route:
    offers = handler.offers if isinstance(handler, Negotiated) else ()
    return Route(operation, partial(handler, service), offers)


class App:
    """ASGI: each request is an exchange of its own."""

    def __init__(self, site: Site) -> None:
        self.site = site

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "http":
            await Exchange(self.site, scope, receive, send).run()
        elif scope["type"] == "lifespan":
            await _live(receive, send)


async def _live(receive: Receive, send: Send) -> None:
    """There is nothing to start or to end, but servers ask."""
    for moment in ("startup", "shutdown"):
        await receive()
        await send({"type": f"lifespan.{moment}.complete"})


def _check_complete(agreed: set[str], handled: set[str]) -> None:
    if agreed != handled:
        raise ValueError(
            f"operations without a handler {sorted(agreed - handled)}, "
            f"handlers without an operation {sorted(handled - agreed)}"
        )


def _missing(path: str) -> Exception:
    """The fault of a path that the contract does not have."""
    if asked := FORMAT_PATH.fullmatch(path):
        message = f"no format {asked[2]!r}; there are {', '.join(FORMATS[asked[1]])}"
        return UnknownFormat("format", message)
    return RequestFault(problems.NO_SUCH_PATH, f"{path!r}; /openapi.yaml names what there is")
