"""Steps of an operation that answers a question, the state they share, and bodies of requests."""

import re
from collections.abc import Awaitable, Callable, Mapping
from contextlib import AbstractAsyncContextManager, nullcontext
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Generic, TypeVar
from urllib.parse import parse_qsl

from msgspec import Struct
from starlette.requests import Request
from starlette.responses import Response

from posefield.characters.user_character import EMPTY, CharacterFolder
from posefield.http import header_fields
from posefield.http.access.access_control import AccessPolicy
from posefield.http.api.problems import BAD_BODY, BODY_TOO_LARGE, NOT_JSON, OVERLOADED, RequestError
from posefield.http.api.settings import Settings
from posefield.http.batching import ClipBatcher, PoseBatcher
from posefield.http.readiness import Readiness
from posefield.http.static_page import StaticPage
from posefield.http.telemetry import LogBuffer
from posefield.question import json_decoding, text_decoding
from posefield.registry.model_registry import ModelRegistry
from posefield.synthesis.synthesizer import Synthesizer

MEDIA_TYPE = "application/json"

FREE_BYTES = 64 * 1024
"""Bytes of each body that do not count: the number of open requests bounds their memory, and small
requests succeed while large bodies exhaust the limit."""


@dataclass
class BodyMemory:
    """Memory of the bodies of open requests, beyond the first FREE bytes of each.

    limit: maximum of their sum, bytes. used: their sum, bytes.
    """

    limit: int
    used: int = 0

    def take(self, size: int) -> None:
        """Add `size` bytes; raises RequestError 503 beyond the limit."""
        if self.used + size > self.limit:
            detail = f"bodies of other requests take {self.used} of {self.limit} bytes"
            raise RequestError(OVERLOADED, detail, headers=_CLOSE | {"Retry-After": "1"})
        self.used += size

    def release(self, size: int) -> None:
        """Subtract the `size` bytes of a finished request."""
        self.used -= size


async def read_body(request: Request, limit: int, memory: BodyMemory) -> bytes:
    """Return the body of a JSON request, with a Content-Length or chunked.

    limit: bytes. `request.scope["body_memory"]` is set to the bytes taken from `memory`, also when
    this raises. Raises RequestError for another media type (415), a body beyond the limit (413), an
    incomplete body (400) and exhausted memory (503).
    """
    _check_media_type(request.headers.get("content-type", ""))
    declared = _declared_length(request)
    if declared > limit:
        raise _too_large(limit)
    found, taken = bytearray(), 0
    async for chunk in request.stream():
        found += chunk
        if len(found) > limit:
            raise _too_large(limit)
        if (beyond := len(found) - FREE_BYTES) > taken:
            memory.take(beyond - taken)
            request.scope["body_memory"] = taken = beyond
    if declared != len(found) and declared:
        # httptools skips the body of a request with an Upgrade to another protocol (h2c).
        detail = f"{len(found)} of {declared} bytes arrived; send HTTP/1.1 without `Upgrade`"
        raise RequestError(BAD_BODY, detail, {"pointer": ""}, _CLOSE)
    return bytes(found)


def _check_media_type(given: str) -> None:
    name, _, parameters = given.partition(";")
    charset = parameters.strip().lower()
    if name.strip().lower() != MEDIA_TYPE or charset not in ("", "charset=utf-8"):
        raise RequestError(NOT_JSON, f"Content-Type {given!r}, expected {MEDIA_TYPE!r}")


def _declared_length(request: Request) -> int:
    length = request.headers.get("content-length", "")
    return int(length) if length.isascii() and length.isdigit() and len(length) < 20 else 0


def _too_large(limit: int) -> RequestError:
    detail = f"more than {limit} bytes, expected at most {limit}"
    return RequestError(BODY_TOO_LARGE, detail, headers=_CLOSE)


# The client may still be sending the rest of the body: closing the connection stops it.
_CLOSE = {"Connection": "close"}


@dataclass(frozen=True)
class Service:
    """Shared state of all operations.

    contract: version of the contract. pages: by operationId. rules: access policy. origins: for
    CORS. log: of requests; None for none. code: digest for entity tags. batcher: of pose requests.
    desk: of file requests. characters: of users.
    """

    readiness: Readiness
    settings: Settings
    contract: str
    pages: Mapping[str, StaticPage]
    access_policy: AccessPolicy
    origins: frozenset[bytes] = frozenset()
    log: LogBuffer | None = None
    code: bytes = field(default_factory=header_fields.code_digest)
    pose_batcher: PoseBatcher = field(default_factory=PoseBatcher)
    clip_batcher: ClipBatcher = field(default_factory=ClipBatcher)
    characters: CharacterFolder = EMPTY

    @cached_property
    def bodies(self) -> BodyMemory:
        """Memory limit on the bodies of open requests."""
        return BodyMemory(self.settings.bodies_memory)

    def lifetime(self, model: str) -> bytes:
        """Return the Cache-Control of a response.

        model: key in the path, a name with or without a hash.
        """
        return header_fields.cache_control(
            model, self.settings.alias_seconds, self.access_policy.requires_credentials
        )

    @property
    def registry(self) -> ModelRegistry:
        """Current models; a reload can replace them, so read this once per request."""
        return self.readiness.models.registry


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

    It raises as `read_body` and `json_decoding.decode_question`.
    """

    async def decode(context: Context[Any], request: Request) -> QuestionStruct:
        service = context.service
        content = await read_body(request, service.settings.body_limit, service.bodies)
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
