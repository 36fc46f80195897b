"""Handlers of the operations on trust: sigma, why and suggestions."""

import orjson
from starlette.requests import Request
from starlette.responses import Response

from posefield.common.errors import InvalidField
from posefield.encode.formats import TableEncoder
from posefield.encode.tables import model_tables
from posefield.http import responses, service
from posefield.http.decoding import request_questions
from posefield.http.service import Service
from posefield.question.model_question import SigmaQuestion, SuggestQuestion, WhyQuestion
from posefield.question.results import SigmaGrid
from posefield.synthesis import sigma_grid
from posefield.synthesis.capture_suggestions import suggest
from posefield.synthesis.explanation import why
from posefield.synthesis.synthesizer import Synthesizer

GridEncoder = TableEncoder[SigmaGrid]

# The first request inverts the matrix of all captured clips: some milliseconds for this many.
CLIPS_AT_ONCE = 100


async def get_sigma(encoder: GridEncoder, served: Service, request: Request) -> Response:
    """Return a grid of sigma for the query parameters."""
    return await _grid(served, request, request_questions.of_url(SigmaQuestion, request), encoder)


async def query_sigma(encoder: GridEncoder, served: Service, request: Request) -> Response:
    """Return a grid of sigma for a JSON body."""
    question = await request_questions.of_body(
        SigmaQuestion, request, served.settings.body_limit, served.bodies
    )
    return await _grid(served, request, question, encoder)


async def _grid(
    served: Service, request: Request, question: SigmaQuestion, encoder: GridEncoder
) -> Response:
    model, most = service.model(request), served.settings.grid_limit
    if len(question) > most:
        expected = f"expected at most {most}"
        raise InvalidField("rows", f"{len(question)} points of columns and rows, {expected}")
    quick = len(question) <= encoder.at_once
    content = await service.made(quick, lambda: encoder.encode(sigma_grid.grid(model, question)))
    return responses.attachment(content, encoder, model.name)


async def get_why(served: Service, request: Request) -> Response:
    """Return the captured clips behind an answer, for the query parameters."""
    return await _why(service.model(request), request_questions.of_url(WhyQuestion, request))


async def query_why(served: Service, request: Request) -> Response:
    """Return the captured clips behind an answer, for a JSON body."""
    question = await request_questions.of_body(
        WhyQuestion, request, served.settings.body_limit, served.bodies
    )
    return await _why(service.model(request), question)


async def _why(model: Synthesizer, question: WhyQuestion) -> Response:
    quick = model.session.card.samples <= CLIPS_AT_ONCE
    content = await service.made(
        quick, lambda: orjson.dumps(model_tables.explanation(why(model, question)))
    )
    return Response(content, media_type="application/json")


async def get_suggestions(served: Service, request: Request) -> Response:
    """Return the control points to capture next, for the query parameters."""
    model = service.model(request)
    question = request_questions.of_url(SuggestQuestion, request)

    def make() -> bytes:
        return orjson.dumps(model_tables.suggestions(suggest(model, question)))

    # Ranking a thousand candidates takes a tenth of a second and more.
    return Response(await service.made(False, make), media_type="application/json")
