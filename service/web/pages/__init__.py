"""Static documents: the contract and the HTML pages."""

from collections.abc import Callable
from functools import partial

import orjson
from starlette.requests import Request
from starlette.responses import Response

from service.web import contract
from service.web.contract import Contract
from service.web.pages import standalone
from service.web.service import Handler, Page, Service


def made(agreed: Contract) -> dict[str, Page]:
    """Return the pages by operationId."""
    return {
        "getContract": Page(contract.MEDIA_TYPE, lambda: agreed.source),
        "getContractJson": Page("application/json", lambda: orjson.dumps(agreed.document)),
        "getDocs": _html(partial(standalone.built, standalone.DOCS)),
        "getProblems": _html(_problems),
        "getViewer": _html(partial(standalone.built, standalone.VIEWER)),
    }


def _html(make: Callable[[], bytes]) -> Page:
    return Page("text/html", make, standalone.headers)


def _problems() -> bytes:
    # Jinja and the Markdown parser take 40 ms to import.
    from service.web.pages import problems

    return problems.content()


async def _answer(name: str, service: Service, request: Request) -> Response:
    page = service.pages[name]
    return Response(page.content, headers=page.headers, media_type=page.media_type)


OPERATIONS: dict[str, Handler] = {
    name: partial(_answer, name)
    for name in ("getContract", "getContractJson", "getDocs", "getProblems", "getViewer")
}
