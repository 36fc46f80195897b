"""Documents that are the same for everybody who asks: made once, when the service starts."""

from functools import partial

import orjson
from starlette.requests import Request
from starlette.responses import Response

from service.web import contract
from service.web.contract import Contract
from service.web.pages import docs, problems, viewer
from service.web.service import Handler, Page, Service


def made(agreed: Contract) -> dict[str, Page]:
    """The page of each operation that answers with one."""
    return {
        "getContract": Page(agreed.source, contract.MEDIA_TYPE),
        "getContractJson": Page(orjson.dumps(agreed.document), "application/json"),
        "getDocs": docs.page(agreed),
        "getProblems": problems.page(),
        "getViewer": viewer.page(),
    }


async def _answer(name: str, service: Service, request: Request) -> Response:
    page = service.pages[name]
    return Response(page.content, headers=page.headers, media_type=page.media_type)


OPERATIONS: dict[str, Handler] = {
    name: partial(_answer, name)
    for name in ("getContract", "getContractJson", "getDocs", "getProblems", "getViewer")
}
