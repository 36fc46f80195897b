"""Building of the ASGI application from the contract's operations and the settings."""

import logging
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractAsyncContextManager, nullcontext
from pathlib import Path

from posefield.characters import user_character
from posefield.characters.user_character import EMPTY, CharacterFolder
from posefield.encode.archives import Format
from posefield.http import request, responses, static_page
from posefield.http.access import access_control
from posefield.http.api import contract
from posefield.http.api.contract import Contract, Operation
from posefield.http.api.settings import PREFIX, Settings
from posefield.http.operations import FORMATS, OPERATIONS
from posefield.http.readiness import Readiness
from posefield.http.request import HeadLimits, Service
from posefield.http.request_cycle import App, RouteTree
from posefield.http.routing import Handler, Route
from posefield.http.telemetry import LogBuffer
from posefield.registry.model_registry import FixedRegistry, ModelRegistry

log = logging.getLogger(__name__)
Lifespan = Callable[[Service], AbstractAsyncContextManager[None]]


def no_background_tasks(service: Service) -> AbstractAsyncContextManager[None]:
    """Return a lifespan without background tasks."""
    return nullcontext()


def create_app(
    models: ModelRegistry | Readiness,
    settings: Settings,
    log: LogBuffer | None = None,
    lifespan: Lifespan = no_background_tasks,
) -> App:
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
) -> App:
    """Return the application of a contract and the handlers of its operations.

    handlers: by operationId. Raises ValueError for an operation without a handler, a handler
    without an operation and formats that differ from the encoders', and InvalidField or FileError
    for invalid settings of access, origins, hosts or characters.
    """
    ids = {operation.id for operation in agreed.operations}
    if ids != set(handlers):
        raise ValueError(
            f"operations without a handler {sorted(ids - set(handlers))}, "
            f"handlers without an operation {sorted(set(handlers) - ids)}"
        )
    policy = access_control.from_settings(settings)
    origins = responses.parse_origins(settings.origins, f"{PREFIX}ORIGINS")
    characters = _characters(settings)
    hosts = request.host_names(settings.hosts, f"{PREFIX}HOSTS")
    routes = RouteTree(
        route
        for operation in agreed.operations
        for route in _routes(operation, handlers[operation.id])
    )
    service = Service(
        HeadLimits(settings.url_limit, settings.head_limit, hosts),
        Readiness(FixedRegistry(models)) if isinstance(models, ModelRegistry) else models,
        settings,
        agreed.version,
        static_page.static_pages(agreed),
        policy,
        origins,
        log,
        characters,
    )
    return App(service, routes, lifespan)


def _characters(settings: Settings) -> CharacterFolder:
    """Return the characters of users; a file that cannot be used is logged and stops no other."""
    if not settings.characters:
        return EMPTY
    folder = user_character.read_folder(Path(settings.characters), settings.character_prefix)
    for file, reason in folder.faults.items():
        log.warning("character %s cannot be used: %s", file, reason)
    return folder


def _routes(operation: Operation, handler: Handler) -> Iterator[Route]:
    """Yield the routes of an operation: one per format if its path ends in `{format}`, else one."""
    encoders = FORMATS.get(operation.id, FORMATS.get(operation.id.removesuffix("InFormat"), {}))
    _check_formats(operation, encoders)
    if not operation.formats:
        offers = tuple((name, encoder.media_type) for name, encoder in encoders.items())
        yield Route(operation, handler, offers=offers)
    for name in operation.formats:
        yield Route(operation, handler, name)


def _check_formats(operation: Operation, encoders: Mapping[str, Format]) -> None:
    """Raise ValueError unless the contract lists the encoders' formats and media types."""
    media_types = {name: encoder.media_type for name, encoder in encoders.items()}
    agreed = dict(operation.formats), {*operation.media_types}
    encoded = media_types if operation.formats else {}, {*media_types.values()}
    if (operation.formats or encoders) and agreed != encoded:
        raise ValueError(f"{operation.id}: the contract has {agreed}, its handler {encoded}")
