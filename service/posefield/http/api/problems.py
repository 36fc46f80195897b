"""Problem responses (RFC 9457): mapping of errors to statuses and problem types.

No other module maps domain errors to HTTP statuses.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import orjson
from starlette.requests import Request
from starlette.responses import Response

from posefield.common.errors import (
    FormError,
    InvalidField,
    OutOfReach,
    OutsideSamples,
    QueryError,
    UnknownFormat,
    UnknownModel,
)
from posefield.question.json_decoding import pointer

MEDIA_TYPE = "application/problem+json"
TYPE_PREFIX = "urn:posefield:problem:"
PAGE = "/problems"
LONGEST = 1000
"""Maximum characters of a detail."""


@dataclass(frozen=True)
class Kind:
    """A kind of problem.

    status: HTTP status code. name: last part of the type. title: short text for people.
    """

    status: int
    name: str
    title: str

    @property
    def type(self) -> str:
        """Problem type, a URN, which identifies the kind."""
        return TYPE_PREFIX + self.name

    @property
    def help(self) -> str:
        """Value of the Link header to the documentation of the kind."""
        return f'<{PAGE}#{self.name}>; rel="help"'


BAD_PARAMETER = Kind(400, "bad-parameter", "A query parameter cannot be read")
BAD_BODY = Kind(400, "bad-body", "The body cannot be read")
UNAUTHENTICATED = Kind(401, "unauthenticated", "Nobody known asks")
FORBIDDEN = Kind(403, "forbidden", "Whoever asks may not")
NO_SUCH_PATH = Kind(404, "no-such-path", "Nothing lies at this path")
METHOD_NOT_ALLOWED = Kind(405, "method-not-allowed", "This path does not take this method")
NOT_ACCEPTABLE = Kind(406, "not-acceptable", "Nothing that is accepted is there")
BODY_TOO_LARGE = Kind(413, "body-too-large", "The body is too large")
URL_TOO_LONG = Kind(414, "url-too-long", "The URL is too long")
NOT_JSON = Kind(415, "unsupported-media-type", "The body must be JSON")
OVERLOADED = Kind(503, "overloaded", "The service has too much to do; ask again soon")
LATE = Kind(503, "late", "The answer took too long")
NOT_READY = Kind(503, "not-ready", "The service should not be sent requests now")
INTERNAL = Kind(500, "internal-error", "The service failed; the fault is not in the request")

UNKNOWN_HOST = Kind(421, "unknown-host", "The service does not answer under this name")
HEAD_TOO_LARGE = Kind(431, "head-too-large", "The request's head is too large")

OF_HEAD = (UNKNOWN_HOST, URL_TOO_LONG, HEAD_TOO_LARGE)
"""Kinds raised before routing; see service/posefield/http/middleware/request_head.py."""
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

KINDS = (*OF_REQUEST, *OF_HEAD, *OF_LOAD, *TABLE.values(), INTERNAL)

_IN_THE_PATH = ("model", "format")
_REPEATED = {"times": "time", "targets": "target"}
"""Fields that a query string gives as one parameter per element."""


class RequestFault(Exception):
    """Error of a request, with its kind of problem.

    kind: of the problem. detail: text for the client. place: location of the error, as
    {"pointer": ...} or {"parameter": ...}. headers: of the response.
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
    """Return the response to a RequestFault."""
    detail = _cut(fault.detail)
    errors = [{**fault.place, "detail": detail}] if fault.place else []
    return _answer(request, fault.kind, detail, errors, fault.headers)


def of_query_error(request: Request, error: QueryError) -> Response:
    """Return the response to a QueryError."""
    place = _place(error, in_body=request.method == "POST")
    errors = [{**place, "detail": _cut(error.message)}]
    return _answer(request, _kind(error, request.method), _cut(str(error)), errors)


def _kind(error: QueryError, method: str) -> Kind:
    if isinstance(error, FormError):
        return BAD_BODY if method == "POST" else BAD_PARAMETER
    return TABLE[type(error)]


def within(error: QueryError, where: str) -> RequestFault:
    """Return the fault of one question of many.

    where: JSON pointer to that question in the body.
    """
    place = where + _place(error, in_body=True)["pointer"]
    detail = f"{place.removeprefix('/')}: {error.message}"
    return RequestFault(TABLE[type(error)], detail, {"pointer": place})


def internal(request: Request) -> Response:
    """Return the response to an unexpected exception: the request id and no details."""
    return _answer(request, INTERNAL, "see the service's log under the id in `instance`", [])


def _cut(detail: str) -> str:
    """Return the detail, shortened in the middle to LONGEST: it may quote the request."""
    if len(detail) <= LONGEST:
        return detail
    return f"{detail[: LONGEST - 105]} ... {detail[-100:]}"


def _place(error: QueryError, in_body: bool) -> dict[str, str]:
    """Return the location of an error's field in its request: a pointer or a parameter."""
    head, _, rest = error.field.partition("/")
    if isinstance(error, FormError) and in_body:
        return {"pointer": f"/{error.field}" if error.field else ""}
    if error.field in _IN_THE_PATH:
        return {"parameter": error.field}
    if in_body:
        # A control's name is one key, even if it contains slashes.
        keys = [rest] if head == "controls" else rest.split("/")
        index = "" if error.index is None else str(error.index)
        return {"pointer": pointer(*filter(None, (head, *keys, index)))}
    if head == "camera":
        return {"parameter": "camera" if rest == "position" else rest or head}
    if head in _REPEATED:
        return {"parameter": _REPEATED[head]}
    return {"parameter": rest or head}


def _answer(
    request: Request,
    kind: Kind,
    detail: str,
    errors: list[dict[str, str]],
    headers: Mapping[str, str] | None = None,
) -> Response:
    content = document(kind, detail, request.state.request_id, errors)
    sent = {"Link": kind.help, **(headers or {})}
    return Response(orjson.dumps(content), kind.status, sent, MEDIA_TYPE)


def document(
    kind: Kind, detail: str, instance: str, errors: Sequence[Mapping[str, str]]
) -> dict[str, object]:
    """Return a Problem (schema of the contract)."""
    return {
        "type": kind.type,
        "title": kind.title,
        "status": kind.status,
        "detail": detail,
        "instance": instance,
        "errors": errors,
    }
