"""Static documents: the contract and the HTML pages."""

from collections.abc import Callable
from functools import partial

import orjson

from posefield.http.api import contract
from posefield.http.api.contract import Contract
from posefield.http.pages import static_page
from posefield.http.pages.static_page import Page


def made(agreed: Contract) -> dict[str, Page]:
    """Return the pages by operationId."""
    return {
        "getContract": Page(contract.MEDIA_TYPE, lambda: agreed.source),
        "getContractJson": Page("application/json", lambda: orjson.dumps(agreed.document)),
        "getDocs": _html(partial(static_page.built, static_page.DOCS)),
        "getProblems": _html(_problems),
        "getViewer": _html(partial(static_page.built, static_page.VIEWER)),
    }


def _html(make: Callable[[], bytes]) -> Page:
    return Page("text/html", make, static_page.headers)


def _problems() -> bytes:
    # Jinja and the Markdown parser take 40 ms to import.
    from posefield.http.pages import problems_page

    return problems_page.content()
