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
from posefield.question.json_decoding import json_pointer

MEDIA_TYPE = "application/problem+json"
TYPE_PREFIX = "urn:posefield:problem:"
PAGE = "/problems"
MAX_DETAIL_LENGTH = 1000
"""Maximum characters of a detail."""


@dataclass(frozen=True)
class ProblemKind:
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


BAD_PARAMETER = ProblemKind(400, "bad-parameter", "A query parameter cannot be read")
BAD_BODY = ProblemKind(400, "bad-body", "The body cannot be read")
UNAUTHENTICATED = ProblemKind(401, "unauthenticated", "Credentials are missing or invalid")
FORBIDDEN = ProblemKind(403, "forbidden", "The credentials do not permit this request")
NO_SUCH_PATH = ProblemKind(404, "no-such-path", "There is no resource at this path")
METHOD_NOT_ALLOWED = ProblemKind(405, "method-not-allowed", "This path does not take this method")
NOT_ACCEPTABLE = ProblemKind(406, "not-acceptable", "No acceptable format is available")
BODY_TOO_LARGE = ProblemKind(413, "body-too-large", "The body is too large")
URL_TOO_LONG = ProblemKind(414, "url-too-long", "The URL is too long")
NOT_JSON = ProblemKind(415, "unsupported-media-type", "The body must be JSON")
OVERLOADED = ProblemKind(503, "overloaded", "The service is overloaded; retry later")
DEADLINE_EXCEEDED = ProblemKind(503, "late", "The response took too long")
NOT_READY = ProblemKind(503, "not-ready", "The service is not ready for requests")
INTERNAL = ProblemKind(500, "internal-error", "The service failed; the request is not the cause")

UNKNOWN_HOST = ProblemKind(421, "unknown-host", "The service does not answer under this name")
HEAD_TOO_LARGE = ProblemKind(431, "head-too-large", "The request's head is too large")

HEAD_PROBLEMS = (UNKNOWN_HOST, URL_TOO_LONG, HEAD_TOO_LARGE)
"""Kinds raised before routing; see `request.HeadLimits`."""
LOAD_PROBLEMS = (OVERLOADED, DEADLINE_EXCEEDED, NOT_READY)
REQUEST_PROBLEMS = (
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

QUERY_ERROR_PROBLEMS: dict[type[QueryError], ProblemKind] = {
    UnknownModel: ProblemKind(404, "unknown-model", "No model of that name"),
    UnknownFormat: ProblemKind(404, "unknown-format", "No format of that name"),
    InvalidField: ProblemKind(422, "invalid-field", "A field is missing, unknown or out of range"),
    OutsideSamples: ProblemKind(
        422, "outside-samples", "The controls lie outside what was sampled"
    ),
    OutOfReach: ProblemKind(422, "out-of-reach", "A target cannot be reached"),
}

PROBLEM_KINDS = (
    *REQUEST_PROBLEMS,
    *HEAD_PROBLEMS,
    *LOAD_PROBLEMS,
    *QUERY_ERROR_PROBLEMS.values(),
    INTERNAL,
)

_PATH_PARAMETERS = ("model", "format")
_REPEATED_PARAMETERS = {"times": "time", "targets": "target", "labels": "label"}
"""Fields that a query string gives as one parameter per element."""


class RequestError(Exception):
    """Error of a request, with its kind of problem.

    kind: of the problem. detail: text for the client. location: of the error, as
    {"pointer": ...} or {"parameter": ...}. headers: of the response.
    """

    def __init__(
        self,
        kind: ProblemKind,
        detail: str,
        location: Mapping[str, str] | None = None,
        headers: Mapping[str, str] | None = None,
    ) -> None:
        super().__init__(detail)
        self.kind = kind
        self.detail = detail
        self.location = location
        self.headers = headers


def request_error_response(request: Request, fault: RequestError) -> Response:
    """Return the response to a RequestError."""
    detail = _shortened(fault.detail)
    errors = [{**fault.location, "detail": detail}] if fault.location else []
    return _problem_response(request, fault.kind, detail, errors, fault.headers)


def query_error_response(request: Request, error: QueryError) -> Response:
    """Return the response to a QueryError."""
    in_body = request.method == "POST"
    if isinstance(error, FormError):
        kind = BAD_BODY if in_body else BAD_PARAMETER
    else:
        kind = QUERY_ERROR_PROBLEMS[type(error)]
    errors = [{**_error_location(error, in_body), "detail": _shortened(error.message)}]
    return _problem_response(request, kind, _shortened(str(error)), errors)


def nested_error(error: QueryError, where: str) -> RequestError:
    """Return the fault of one question of many.

    where: JSON pointer to that question in the body.
    """
    pointer = where + _error_location(error, in_body=True)["pointer"]
    detail = f"{pointer.removeprefix('/')}: {error.message}"
    return RequestError(QUERY_ERROR_PROBLEMS[type(error)], detail, {"pointer": pointer})


def parameter_error(error: QueryError) -> RequestError:
    """Return the fault of a query parameter of a request with a body; error: names it."""
    detail = f"{error.field}: {error.message}"
    return RequestError(QUERY_ERROR_PROBLEMS[type(error)], detail, {"parameter": error.field})


def internal_error_response(request: Request) -> Response:
    """Return the response to an unexpected exception: the request id and no details."""
    return _problem_response(
        request, INTERNAL, "see the service's log under the id in `instance`", []
    )


def _shortened(detail: str) -> str:
    """Return the detail, shortened in the middle: it may quote the request."""
    if len(detail) <= MAX_DETAIL_LENGTH:
        return detail
    return f"{detail[: MAX_DETAIL_LENGTH - 105]} ... {detail[-100:]}"


def _error_location(error: QueryError, in_body: bool) -> dict[str, str]:
    """Return the location of an error's field in its request: a pointer or a parameter."""
    head, _, rest = error.field.partition("/")
    if isinstance(error, FormError) and in_body:
        return {"pointer": f"/{error.field}" if error.field else ""}
    if error.field in _PATH_PARAMETERS:
        return {"parameter": error.field}
    if in_body:
        # A control's name is one key, even if it contains slashes.
        keys = [rest] if head == "controls" else rest.split("/")
        index = "" if error.index is None else str(error.index)
        return {"pointer": json_pointer(*filter(None, (head, *keys, index)))}
    if head == "camera":
        return {"parameter": "camera" if rest == "position" else rest or head}
    if head in _REPEATED_PARAMETERS:
        return {"parameter": _REPEATED_PARAMETERS[head]}
    return {"parameter": rest or head}


def _problem_response(
    request: Request,
    kind: ProblemKind,
    detail: str,
    errors: list[dict[str, str]],
    headers: Mapping[str, str] | None = None,
) -> Response:
    content = problem_document(kind, detail, request.state.request_id, errors)
    sent = {"Link": kind.help, **(headers or {})}
    return Response(orjson.dumps(content), kind.status, sent, MEDIA_TYPE)


def problem_document(
    kind: ProblemKind, detail: str, instance: str, errors: Sequence[Mapping[str, str]]
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
