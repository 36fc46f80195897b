"""ASGI application of the contract's operations."""

import logging
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractAsyncContextManager, nullcontext
from functools import partial
from pathlib import Path

from starlette.types import Receive, Scope, Send

from posefield.characters import user_character
from posefield.characters.user_character import EMPTY, CharacterFolder
from posefield.common.errors import UnknownFormat, did_you_mean
from posefield.http import header_fields, request_cycle, static_page
from posefield.http.access import access_control
from posefield.http.api import contract, problems
from posefield.http.api.contract import Contract, Operation
from posefield.http.api.problems import RequestError
from posefield.http.api.settings import PREFIX, Settings
from posefield.http.header_fields import HeadLimits
from posefield.http.operations import OPERATIONS
from posefield.http.readiness import Readiness
from posefield.http.request_cycle import ServerState
from posefield.http.routing import Route, RouteTree
from posefield.http.steps import Handler, Service, Steps
from posefield.http.telemetry import LogBuffer
from posefield.registry.model_registry import FixedRegistry, ModelRegistry

log = logging.getLogger(__name__)
Lifespan = Callable[[ServerState], AbstractAsyncContextManager[None]]


def no_background_tasks(site: ServerState) -> AbstractAsyncContextManager[None]:
    """Return a lifespan without background tasks."""
    return nullcontext()


def create_app(
    models: ModelRegistry | Readiness,
    settings: Settings,
    log: LogBuffer | None = None,
    lifespan: Lifespan = no_background_tasks,
) -> "App":
    """Return the application of the contract for some models.

    log: of requests; None for none. lifespan: context of the background tasks of the server.
    """
    return build_app(contract.load_contract(), OPERATIONS, models, settings, log, lifespan)


def build_app(
    agreed: Contract,
    handlers: Mapping[str, Handler],
    models: ModelRegistry | Readiness,
    settings: Settings,
    log: LogBuffer | None = None,
    lifespan: Lifespan = no_background_tasks,
) -> "App":
    """Return the application of a contract and the handlers of its operations.

    handlers: by operationId. Raises ValueError for an operation without a handler, a handler
    without an operation and formats that differ from the handler's, and InvalidField or FileError
    for invalid settings of access, origins, hosts or characters.
    """
    _check_complete({operation.id for operation in agreed.operations}, set(handlers))
    readiness = Readiness(FixedRegistry(models)) if isinstance(models, ModelRegistry) else models
    rules = access_control.from_settings(settings)
    origins = header_fields.parse_origins(settings.origins, f"{PREFIX}ORIGINS")
    service = Service(
        readiness,
        settings,
        agreed.version,
        static_page.static_pages(agreed),
        rules,
        origins,
        log,
        characters=_characters(settings),
    )
    places = RouteTree(
        route
        for operation in agreed.operations
        for route in _routes(operation, handlers[operation.id])
    )
    hosts = header_fields.host_names(settings.hosts, f"{PREFIX}HOSTS")
    limits = HeadLimits(settings.url_limit, settings.head_limit, hosts)
    return App(ServerState(places, service, partial(_missing, places), limits), lifespan)


def _characters(settings: Settings) -> CharacterFolder:
    """Return the characters of users; a file that cannot be used is logged and stops no other."""
    if not settings.characters:
        return EMPTY
    found = user_character.read_folder(Path(settings.characters), settings.character_prefix)
    for fault in found.faults:
        log.warning("character %s cannot be used: %s", fault.file, fault.reason)
    return found


def _routes(operation: Operation, handler: Handler) -> Iterator[Route]:
    """Yield the routes of an operation: one per format if its path ends in `{format}`, else one."""
    formats = handler.formats if isinstance(handler, Steps) else {}
    offers = tuple((name, each.media_type) for name, each in formats.items())
    _check_formats(operation, dict(offers))
    if not operation.formats:
        yield Route(operation, handler, offers=offers)
    for name in operation.formats:
        yield Route(operation, handler, name)


def _check_formats(operation: Operation, encoders: Mapping[str, str]) -> None:
    """Raise ValueError unless the contract lists the handler's formats and media types."""
    agreed = dict(operation.formats), {*operation.media_types}
    made = dict(encoders if operation.formats else {}), {*encoders.values()}
    if (operation.formats or encoders) and agreed != made:
        raise ValueError(f"{operation.id}: the contract has {agreed}, its handler {made}")


class App:
    """ASGI application; see `request_cycle` for a request."""

    def __init__(self, site: ServerState, lifespan: Lifespan) -> None:
        self.site = site
        self._lifespan = lifespan

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "http":
            await request_cycle.handle(self.site, scope, receive, send)
        elif scope["type"] == "lifespan":
            await receive()
            async with self._lifespan(self.site):
                await send({"type": "lifespan.startup.complete"})
                await receive()
            await send({"type": "lifespan.shutdown.complete"})


def _check_complete(agreed: set[str], handled: set[str]) -> None:
    if agreed != handled:
        raise ValueError(
            f"operations without a handler {sorted(agreed - handled)}, "
            f"handlers without an operation {sorted(handled - agreed)}"
        )


def _missing(places: RouteTree, path: str) -> Exception:
    """Return the error of a path that is not in the contract."""
    if found := places.other_formats(path):
        asked, known = found
        hint = did_you_mean(asked, known)
        return UnknownFormat("format", f"no format {asked!r}{hint}; there are {', '.join(known)}")
    return RequestError(problems.NO_SUCH_PATH, f"{path!r}; /openapi.yaml names what there is")
