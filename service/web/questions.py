"""Decoding of questions from query parameters or from a JSON body."""

import re
from typing import TypeVar
from urllib.parse import parse_qsl

from msgspec import Struct
from starlette.requests import Request

from service.question import body as bodies
from service.question import words
from service.web import body
from service.web.service import Service

Question = TypeVar("Question", bound=Struct)
_ESCAPES = re.compile("[%+]")


def of_url(form: type[Question], request: Request) -> Question:
    """Return the question of a request's query parameters; raises as `words.question`."""
    return words.question(form, pairs(request.scope["query_string"]))


async def of_body(form: type[Question], service: Service, request: Request) -> Question:
    """Return the question of a request's JSON body; raises as `body.read`, `bodies.question`."""
    content = await body.read(request, service.settings.body_limit, service.bodies)
    return bodies.question(form, content)


def pairs(query_string: bytes) -> list[tuple[str, str]]:
    """Return the decoded names and values of a query string."""
    text = query_string.decode("latin-1")
    if _ESCAPES.search(text):
        return parse_qsl(text, keep_blank_values=True)
    # Without escapes this gives the result of parse_qsl in a fifth of its time.
    split = (part.partition("=") for part in text.split("&") if part)
    return [(name, value) for name, _, value in split]
