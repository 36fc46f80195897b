"""Steps of an operation that answers a question about a model."""

import re
from collections.abc import Awaitable, Callable, Mapping
from contextlib import AbstractAsyncContextManager, nullcontext
from dataclasses import dataclass
from typing import Any, Generic, TypeVar
from urllib.parse import parse_qsl

from msgspec import Struct
from starlette.requests import Request
from starlette.responses import Response

from posefield.http.decoding import request_body
from posefield.http.service import Service
from posefield.question import json_decoding, text_decoding
from posefield.registry.model_registry import ModelRegistry
from posefield.synthesis.synthesizer import Synthesizer

_ESCAPES = re.compile("[%+]")

Form = TypeVar("Form")
QuestionStruct = TypeVar("QuestionStruct", bound=Struct)
Question = TypeVar("Question")
Task = TypeVar("Task")
Answer = TypeVar("Answer")
Content = TypeVar("Content")


@dataclass(frozen=True)
class Context(Generic[Form]):
    """A request after it was authorised: state of the service, models and format.

    library: models that the client may read. named: model of the path; None without one.
    """

    service: Service
    library: ModelRegistry
    named: Synthesizer | None
    form: Form

    @property
    def model(self) -> Synthesizer:
        """Return the model of the path; LookupError for an operation whose path names none."""
        if self.named is None:
            raise LookupError("a model, which the path of this operation does not name")
        return self.named


PlainHandler = Callable[[Service, Request], Awaitable[Response]]
"""Handler of an operation that asks no model: pages, lists, health."""


async def unchecked(context: Context[Any], question: Question) -> Question:
    """Return the question: its type and the synthesis check all of it."""
    return question


def unlimited(context: Context[Any], task: object) -> AbstractAsyncContextManager[None]:
    """Return no limit: the work takes about a millisecond, or limits itself."""
    return nullcontext()


@dataclass(frozen=True)
class Steps(Generic[Form, Question, Task, Answer, Content]):
    """Steps by which an operation answers a question about a model, in the order of the fields.

    formats: by name, the default first. decode: returns the question of a request; reads its body.
    validate: returns the question checked against the model and the limits; raises QueryError.
    places: limit on the requests of this kind whose work is done at one time; it is kept until the
    content exists, so that waiting requests hold no results. synthesise: returns the answer.
    encode: returns its bytes, or an iterator over them. respond: returns the response.
    """

    formats: Mapping[str, Form]
    decode: Callable[[Context[Form], Request], Awaitable[Question]]
    validate: Callable[[Context[Form], Question], Awaitable[Task]]
    places: Callable[[Context[Form], Task], AbstractAsyncContextManager[None]]
    synthesise: Callable[[Context[Form], Task], Awaitable[Answer]]
    encode: Callable[[Context[Form], Task, Answer], Awaitable[Content]]
    respond: Callable[[Context[Form], Answer, Content], Response]


Handler = PlainHandler | Steps[Any, Any, Any, Any, Any]


def from_url(
    form: type[QuestionStruct],
) -> Callable[[Context[Any], Request], Awaitable[QuestionStruct]]:
    """Return the step that decodes a question of this type from the query parameters.

    It raises as `text_decoding.decode_question`.
    """

    async def decode(context: Context[Any], request: Request) -> QuestionStruct:
        return text_decoding.decode_question(form, query_pairs(request.scope["query_string"]))

    return decode


def from_body(
    form: type[QuestionStruct],
) -> Callable[[Context[Any], Request], Awaitable[QuestionStruct]]:
    """Return the step that decodes a question of this type from a JSON body.

    It raises as `request_body.read` and `json_decoding.decode_question`.
    """

    async def decode(context: Context[Any], request: Request) -> QuestionStruct:
        service = context.service
        content = await request_body.read_body(request, service.settings.body_limit, service.bodies)
        return json_decoding.decode_question(form, content)

    return decode


def query_pairs(query_string: bytes) -> list[tuple[str, str]]:
    """Return the decoded names and values of a query string."""
    text = query_string.decode("latin-1")
    if _ESCAPES.search(text):
        return parse_qsl(text, keep_blank_values=True)
    # Without escapes this gives the result of parse_qsl in a fifth of its time.
    split = (part.partition("=") for part in text.split("&") if part)
    return [(name, value) for name, _, value in split]
