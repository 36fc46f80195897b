"""Errors as clients see them: class -> status and problem type, RFC 9457.

The only module that knows both the errors of the domain and the statuses of HTTP.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import orjson
from starlette.requests import Request
from starlette.responses import Response

from service.motion.errors import (
    InvalidField,
    OutOfReach,
    OutsideSamples,
    QueryError,
    UnknownFormat,
    UnknownModel,
)

MEDIA_TYPE = "application/problem+json"
TYPE_PREFIX = "urn:posefield:problem:"
INFERENCE = "/v2"
PAGE = "/problems"


@dataclass(frozen=True)
class Kind:
    """A kind of problem: its status, the last part of its type and its title."""

    status: int
    name: str
    title: str

    @property
    def type(self) -> str:
        """What programs tell it by."""
        return TYPE_PREFIX + self.name

    @property
    def help(self) -> str:
        """Header Link to what it means."""
        return f'<{PAGE}#{self.name}>; rel="help"'


BAD_PARAMETER = Kind(400, "bad-parameter", "A query parameter cannot be read")
BAD_BODY = Kind(400, "bad-body", "The body cannot be read")
MALFORMED = Kind(400, "malformed-request", "This is not HTTP as the service reads it")
UNAUTHENTICATED = Kind(401, "unauthenticated", "Nobody known asks")
FORBIDDEN = Kind(403, "forbidden", "Whoever asks may not")
NO_SUCH_PATH = Kind(404, "no-such-path", "Nothing lies at this path")
METHOD_NOT_ALLOWED = Kind(405, "method-not-allowed", "This path does not take this method")
NOT_ACCEPTABLE = Kind(406, "not-acceptable", "Nothing that is accepted is there")
BODY_TOO_LARGE = Kind(413, "body-too-large", "The body is too large")
TOO_SLOW = Kind(408, "request-too-slow", "The request took too long to arrive")
URL_TOO_LONG = Kind(414, "url-too-long", "The URL is too long")
NOT_JSON = Kind(415, "unsupported-media-type", "The body must be JSON")
OVERLOADED = Kind(503, "overloaded", "The service has too much to do; ask again soon")
LATE = Kind(503, "late", "The answer took too long")
NOT_READY = Kind(503, "not-ready", "The service should not be sent requests now")
INTERNAL = Kind(500, "internal-error", "The service failed; the fault is not in the request")

HEAD_TOO_LARGE = Kind(431, "head-too-large", "The request's head is too large")
NO_CONNECTION_LEFT = Kind(503, "no-connection-left", "The service has no connection left")

OF_WIRE = (MALFORMED, TOO_SLOW, URL_TOO_LONG, HEAD_TOO_LARGE, NO_CONNECTION_LEFT)
"""What service/web/protocol.py refuses before any operation is known."""
OF_LOAD = (OVERLOADED, LATE, NOT_READY)
OF_REQUEST = (
    BAD_PARAMETER,
    BAD_BODY,
    UNAUTHENTICATED,
    FORBIDDEN,
    NO_SUCH_PATH,
    METHOD_NOT_ALLOWED,
    NOT_ACCEPTABLE,
    BODY_TOO_LARGE,
    NOT_JSON,
)

TABLE: dict[type[QueryError], Kind] = {
    UnknownModel: Kind(404, "unknown-model", "No model of that name"),
    UnknownFormat: Kind(404, "unknown-format", "No format of that name"),
    InvalidField: Kind(422, "invalid-field", "A field is missing, unknown or out of range"),
    OutsideSamples: Kind(422, "outside-samples", "The controls lie outside what was sampled"),
    OutOfReach: Kind(422, "out-of-reach", "A target cannot be reached"),
}

KINDS = (*OF_REQUEST, *OF_WIRE, *OF_LOAD, *TABLE.values(), INTERNAL)

_IN_THE_PATH = ("model", "format")
_REPEATED = {"times": "time", "targets": "target"}
"""Fields that a query says by a parameter for each."""


class RequestFault(Exception):
    """A request that breaks the contract before any model is asked.

    places: where the fault lies, as {"pointer": ...} or {"parameter": ...}.
    """

    def __init__(
        self,
        kind: Kind,
        detail: str,
        place: Mapping[str, str] | None = None,
        headers: Mapping[str, str] | None = None,
    ) -> None:
        super().__init__(detail)
        self.kind = kind
        self.detail = detail
        self.place = place
        self.headers = headers


def of_fault(request: Request, fault: RequestFault) -> Response:
    """Answer to a request that breaks the contract."""
    errors = [{**fault.place, "detail": fault.detail}] if fault.place else []
    return _answer(request, fault.kind, fault.detail, errors, fault.headers)


def of_query_error(request: Request, error: QueryError) -> Response:
    """Answer to a question that has none."""
    place = _place(error, in_body=request.method == "POST")
    errors = [{**place, "detail": error.message}]
    return _answer(request, TABLE[type(error)], str(error), errors)


def within(error: QueryError, where: str) -> RequestFault:
    """The same fault in one question of many; where: JSON pointer to that question."""
    place = where + _place(error, in_body=True)["pointer"]
    detail = f"{place.removeprefix('/')}: {error.message}"
    return RequestFault(TABLE[type(error)], detail, {"pointer": place})


def internal(request: Request) -> Response:
    """Answer to a failure of the service: nothing of the failure but the request's id."""
    return _answer(request, INTERNAL, "see the service's log under the id in `instance`", [])


def _place(error: QueryError, in_body: bool) -> dict[str, str]:
    """Where a field of a question stands in the request that asked it."""
    head, _, rest = error.field.partition("/")
    if error.field in _IN_THE_PATH:
        return {"parameter": error.field}
    if in_body:
        # A control's name is one key, whatever stands in it.
        keys = [rest] if head == "controls" else rest.split("/")
        index = "" if error.index is None else str(error.index)
        return {"pointer": pointer(*filter(None, (head, *keys, index)))}
    if head == "camera":
        return {"parameter": "camera" if rest == "position" else rest or head}
    if head in _REPEATED:
        return {"parameter": _REPEATED[head]}
    return {"parameter": rest or head}


def pointer(*parts: str) -> str:
    """JSON pointer, RFC 6901."""
    return "".join("/" + part.replace("~", "~0").replace("/", "~1") for part in parts)


def _answer(
    request: Request,
    kind: Kind,
    detail: str,
    errors: list[dict[str, str]],
    headers: Mapping[str, str] | None = None,
) -> Response:
    content = document(kind, detail, request.state.request_id, errors)
    if request.scope["path"].startswith(INFERENCE):
        # Clients of the Open Inference Protocol read nothing else.
        content["error"] = detail
    sent = {"Link": kind.help, **(headers or {})}
    return Response(orjson.dumps(content), kind.status, sent, MEDIA_TYPE)


def document(
    kind: Kind, detail: str, instance: str, errors: Sequence[Mapping[str, str]]
) -> dict[str, object]:
    """Schema Problem of the contract."""
    return {
        "type": kind.type,
        "title": kind.title,
        "status": kind.status,
        "detail": detail,
        "instance": instance,
        "errors": errors,
    }
