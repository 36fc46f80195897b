"""Static documents: the contract and the HTML pages."""

from collections.abc import Callable
from functools import partial

import orjson

from posefield.http.api import contract
from posefield.http.api.contract import Contract
from posefield.http.pages import static_page
from posefield.http.pages.static_page import StaticPage


def static_pages(agreed: Contract) -> dict[str, StaticPage]:
    """Return the pages by operationId."""
    return {
        "getContract": StaticPage(contract.MEDIA_TYPE, lambda: agreed.source),
        "getContractJson": StaticPage("application/json", lambda: orjson.dumps(agreed.document)),
        "getDocs": _html_page(partial(static_page.built_page, static_page.DOCS)),
        "getProblems": _html_page(_problems),
        "getViewerCrowd": StaticPage(
            "text/javascript", partial(static_page.viewer_script, static_page.VIEWER_SCRIPT)
        ),
        "getViewer": StaticPage(
            "text/html",
            partial(static_page.built_page, static_page.VIEWER),
            partial(static_page.headers, loads_scripts=True),
        ),
    }


def _html_page(make: Callable[[], bytes]) -> StaticPage:
    return StaticPage("text/html", make, static_page.headers)


def _problems() -> bytes:
    # Jinja and the Markdown parser take 40 ms to import.
    from posefield.http.pages import problems_page

    return problems_page.problems_html()
