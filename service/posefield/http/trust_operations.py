"""Steps of the requests on trust: sigma, why and suggestions."""

from contextlib import AbstractAsyncContextManager
from functools import partial
from typing import Any

from starlette.responses import Response

from posefield.common.errors import InvalidField
from posefield.encode.formats import GRID_ENCODERS, TableEncoder
from posefield.encode.tables import model_tables
from posefield.http import responses, worker_threads
from posefield.http.steps import Context, Steps, from_body, from_url, unchecked
from posefield.question.model_question import SigmaQuestion, SuggestQuestion, WhyQuestion
from posefield.question.results import Explanation, SigmaGrid, Suggestions
from posefield.synthesis import trust
from posefield.synthesis.trust import explain_result, suggest

Grids = Context[TableEncoder[SigmaGrid]]
Model = Context[None]


async def limit_grid(context: Grids, question: SigmaQuestion) -> SigmaQuestion:
    """Return the question; InvalidField for a grid beyond the limit of the settings."""
    most = context.service.settings.grid_limit
    if len(question) > most:
        expected = f"expected at most {most}"
        raise InvalidField("rows", f"{len(question)} points of columns and rows, {expected}")
    return question


def quick_places(context: object, question: object) -> AbstractAsyncContextManager[None]:
    """Return the limit on work of milliseconds."""
    return worker_threads.POSE_LIMITER


async def compute_grid(context: Grids, question: SigmaQuestion) -> SigmaGrid:
    """Return sigma and support on the grid."""
    return await worker_threads.within(trust.grid, context.model, question)


async def encode_grid(context: Grids, question: SigmaQuestion, answer: SigmaGrid) -> bytes:
    """Return the grid as bytes."""
    return await worker_threads.within(context.form.encode, answer)


def send_grid(context: Grids, answer: SigmaGrid, content: bytes) -> Response:
    """Return the response."""
    return responses.attachment(content, context.form, context.model.name)


_grid = partial(
    Steps[TableEncoder[SigmaGrid], SigmaQuestion, SigmaQuestion, SigmaGrid, bytes],
    GRID_ENCODERS,
    validate=limit_grid,
    places=quick_places,
    synthesise=compute_grid,
    encode=encode_grid,
    respond=send_grid,
)
GET_SIGMA = _grid(decode=from_url(SigmaQuestion))
QUERY_SIGMA = _grid(decode=from_body(SigmaQuestion))


async def explain(context: Model, question: WhyQuestion) -> Explanation:
    """Return the captured clips behind an answer."""
    return await worker_threads.within(explain_result, context.model, question)


async def encode_why(context: Model, question: WhyQuestion, answer: Explanation) -> dict[str, Any]:
    """Return the explanation as plain values."""
    return model_tables.explanation(answer)


def send_document(context: Model, answer: object, content: dict[str, Any]) -> Response:
    """Return the response."""
    return responses.json_document(content)


_why = partial(
    Steps[None, WhyQuestion, WhyQuestion, Explanation, dict[str, Any]],
    {},
    validate=unchecked,
    places=quick_places,
    synthesise=explain,
    encode=encode_why,
    respond=send_document,
)
GET_WHY = _why(decode=from_url(WhyQuestion))
QUERY_WHY = _why(decode=from_body(WhyQuestion))


def suggestion_places(
    context: Model, question: SuggestQuestion
) -> AbstractAsyncContextManager[None]:
    """Return the limit on rankings: a thousand candidates take a tenth of a second and more."""
    return worker_threads.SYNTHESIS_LIMITER


async def rank(context: Model, question: SuggestQuestion) -> Suggestions:
    """Return the control points to capture next."""
    return await worker_threads.within(suggest, context.model, question)


async def encode_suggestions(
    context: Model, question: SuggestQuestion, answer: Suggestions
) -> dict[str, Any]:
    """Return the suggestions as plain values."""
    return model_tables.suggestions(answer)


GET_SUGGESTIONS = Steps(
    {},
    from_url(SuggestQuestion),
    unchecked,
    suggestion_places,
    rank,
    encode_suggestions,
    send_document,
)
