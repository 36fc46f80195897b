"""Grids of sigma, in the formats that programs read."""

from functools import partial

from starlette.requests import Request
from starlette.responses import Response

from service.encode.grids import GRID_ENCODERS, GridEncoder
from service.synthesis import grid
from service.synthesis.grid import GridQuestion
from service.synthesis.synthesizer import Synthesizer
from service.web import answers, body, query, service, sigma_query
from service.web.service import Handler, Service

# A millisecond.
AT_ONCE = 1024


async def get_sigma(encoder: GridEncoder, served: Service, request: Request) -> Response:
    """A grid in the encoder's format, asked for by query parameters."""
    model, pairs = service.model(request), query.pairs(request.scope["query_string"])
    return await _answer(model, sigma_query.of_pairs(pairs, served.settings), encoder)


async def query_sigma(encoder: GridEncoder, served: Service, request: Request) -> Response:
    """A grid in the encoder's format, asked for by a body."""
    model = service.model(request)
    content = await body.read(request, served.settings.body_limit)
    return await _answer(model, sigma_query.of_body(content, served.settings), encoder)


async def _answer(model: Synthesizer, question: GridQuestion, encoder: GridEncoder) -> Response:
    quick = len(question) <= AT_ONCE
    content = await service.made(quick, lambda: encoder.encode(grid.grid(model, question)))
    return answers.attachment(content, encoder.media_type, f"{model.name}.{encoder.extension}")


OPERATIONS: dict[str, Handler] = {
    **{f"getSigma{n.capitalize()}": partial(get_sigma, e) for n, e in GRID_ENCODERS.items()},
    **{f"querySigma{n.capitalize()}": partial(query_sigma, e) for n, e in GRID_ENCODERS.items()},
}
