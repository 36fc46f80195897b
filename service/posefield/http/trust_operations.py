"""Steps of the requests on trust: sigma, why and suggestions."""

from contextlib import AbstractAsyncContextManager, nullcontext
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

# The first request inverts the matrix of all captured clips: some milliseconds for this many.
CLIPS_AT_ONCE = 100


async def limit_grid(context: Grids, question: SigmaQuestion) -> SigmaQuestion:
    """Return the question; InvalidField for a grid beyond the limit of the settings."""
    most = context.service.settings.grid_limit
    if len(question) > most:
        expected = f"expected at most {most}"
        raise InvalidField("rows", f"{len(question)} points of columns and rows, {expected}")
    return question


def grid_places(context: Grids, question: SigmaQuestion) -> AbstractAsyncContextManager[None]:
    """Return the limit on grids that take a thread."""
    return (
        worker_threads.SYNTHESIS_LIMITER
        if len(question) > context.form.inline_limit
        else nullcontext()
    )


async def compute_grid(context: Grids, question: SigmaQuestion) -> SigmaGrid:
    """Return sigma and support on the grid."""
    if len(question) > context.form.inline_limit:
        return await worker_threads.within(trust.grid, context.model, question)
    return trust.grid(context.model, question)


async def encode_grid(context: Grids, question: SigmaQuestion, answer: SigmaGrid) -> bytes:
    """Return the grid as bytes."""
    if len(question) > context.form.inline_limit:
        return await worker_threads.within(context.form.encode, answer)
    return context.form.encode(answer)


def send_grid(context: Grids, answer: SigmaGrid, content: bytes) -> Response:
    """Return the response."""
    return responses.attachment(content, context.form, context.model.name)


_grid = partial(
    Steps[TableEncoder[SigmaGrid], SigmaQuestion, SigmaQuestion, SigmaGrid, bytes],
    GRID_ENCODERS,
    validate=limit_grid,
    places=grid_places,
    synthesise=compute_grid,
    encode=encode_grid,
    respond=send_grid,
)
GET_SIGMA = _grid(decode=from_url(SigmaQuestion))
QUERY_SIGMA = _grid(decode=from_body(SigmaQuestion))


def why_places(context: Model, question: WhyQuestion) -> AbstractAsyncContextManager[None]:
    """Return the limit on explanations by models of many clips."""
    quick = context.model.session.card.samples <= CLIPS_AT_ONCE
    return nullcontext() if quick else worker_threads.SYNTHESIS_LIMITER


async def explain(context: Model, question: WhyQuestion) -> Explanation:
    """Return the captured clips behind an answer."""
    if context.model.session.card.samples <= CLIPS_AT_ONCE:
        return explain_result(context.model, question)
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
    places=why_places,
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
