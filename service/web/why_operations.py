"""Why an answer is as it is."""

import orjson
from starlette.requests import Request
from starlette.responses import Response

from service.encode import reasons
from service.synthesis.synthesizer import Synthesizer
from service.synthesis.why import WhyQuestion, why
from service.web import body, query, service, why_query
from service.web.service import Handler, Service

# Captured clips whose system is inverted, for the first who asks, in some milliseconds.
AT_ONCE = 100


async def get_why(served: Service, request: Request) -> Response:
    """Reasons asked for by query parameters."""
    model = service.model(request)
    return await _answer(model, why_query.of_pairs(query.pairs(request.scope["query_string"])))


async def query_why(served: Service, request: Request) -> Response:
    """Reasons asked for by a body."""
    model = service.model(request)
    content = await body.read(request, served.settings.body_limit)
    return await _answer(model, why_query.of_body(content))


async def _answer(model: Synthesizer, question: WhyQuestion) -> Response:
    quick = model.session.card.samples <= AT_ONCE
    content = await service.made(quick, lambda: orjson.dumps(reasons.plain(why(model, question))))
    return Response(content, media_type="application/json")


OPERATIONS: dict[str, Handler] = {"getWhy": get_why, "queryWhy": query_why}
