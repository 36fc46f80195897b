"""Which clips to capture next."""

import orjson
from starlette.requests import Request
from starlette.responses import Response

from service.encode import suggestions
from service.synthesis.suggest import COUNT, SuggestQuestion, suggest
from service.web import query, service
from service.web.service import Handler, Service


async def get_suggestions(served: Service, request: Request) -> Response:
    """Points asked for by query parameters: count and performer."""
    model = service.model(request)
    single = query.unique(query.pairs(request.scope["query_string"]))
    count = query.whole("count", single.pop("count", str(COUNT)))
    question = SuggestQuestion(count, single.pop("performer", None))

    def make() -> bytes:
        return orjson.dumps(suggestions.plain(suggest(model, question)))

    # To rank a thousand candidates takes a tenth of a second and more.
    return Response(await service.made(False, make), media_type="application/json")


OPERATIONS: dict[str, Handler] = {"getSuggestions": get_suggestions}
