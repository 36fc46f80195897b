"""Exceptions of the client, as one tree under PosefieldError.

Problem has a class for each kind of problem of the contract, below WrongRequest (the request
violates the contract), NotAllowed, Unanswerable (a valid request without a result), Busy and
InternalError. Classes with `again` are retried.
"""

import time
from collections.abc import Mapping
from email.utils import parsedate_to_datetime
from typing import ClassVar

import msgspec

from posefield_client import generated
from posefield_client.generated import CONTRACT

TYPE_PREFIX = "urn:posefield:problem:"
MEDIA_TYPE = "application/problem+json"
GATEWAYS = (429, 502, 503, 504)
"""Statuses with which a gateway reports that the service is unavailable."""


class PosefieldError(Exception):
    """Base of all exceptions that this client raises deliberately."""

    again: ClassVar[bool] = False
    """True if a retry can succeed."""
    retry_after: float | None = None
    """Seconds after which the service accepts a retry."""


class WrongQuestion(PosefieldError, ValueError):
    """Invalid argument; no request was sent."""


class Problem(PosefieldError):
    """Problem document of the service (RFC 9457).

    status: of HTTP. kind: last part of `type`. title, detail: for people. instance: request id, as
    in the service's log. errors: locations of the errors in the request.
    """

    kinds: ClassVar[dict[str, type["Problem"]]] = {}

    def __init_subclass__(cls, kind: str = "") -> None:
        if kind:
            cls.kinds[kind] = cls

    def __init__(self, document: generated.Problem, retry_after: float | None = None) -> None:
        # Pickling between processes repeats the constructor with these arguments.
        super().__init__(document, retry_after)
        self.status = document.status
        self.kind = document.type.removeprefix(TYPE_PREFIX)
        self.title = document.title
        self.detail = document.detail
        self.instance = document.instance
        self.errors = document.errors
        self.retry_after = retry_after

    def __str__(self) -> str:
        return f"{self.title}: {self.detail}" if self.detail else self.title


class WrongRequest(Problem):
    """The request violates the contract."""


class BadParameter(WrongRequest, kind="bad-parameter"):
    """A query parameter cannot be read."""


class BadBody(WrongRequest, kind="bad-body"):
    """The body cannot be read."""


class UnsupportedMediaType(WrongRequest, kind="unsupported-media-type"):
    """The body must be JSON."""


class NotAcceptable(WrongRequest, kind="not-acceptable"):
    """The resource has none of the accepted media types."""


class NoSuchPath(WrongRequest, kind="no-such-path"):
    """The service lacks this path: another service, or an older version."""


class MethodNotAllowed(WrongRequest, kind="method-not-allowed"):
    """The path does not support this method."""


class BodyTooLarge(WrongRequest, kind="body-too-large"):
    """The request's body exceeds the limit of the service."""


class UrlTooLong(WrongRequest, kind="url-too-long"):
    """The URL exceeds the limit of the service."""


class HeadTooLarge(WrongRequest, kind="head-too-large"):
    """The request's headers exceed the limit of the service."""


class UnknownHost(WrongRequest, kind="unknown-host"):
    """The service refuses the request's Host header."""


class NotAllowed(Problem):
    """The key was refused."""


class Unauthenticated(NotAllowed, kind="unauthenticated"):
    """The key is missing or invalid."""


class Forbidden(NotAllowed, kind="forbidden"):
    """The key lacks the permission."""


class Unanswerable(Problem):
    """The request is valid but has no result."""


class UnknownModel(Unanswerable, kind="unknown-model"):
    """The model does not exist, or the key cannot read it."""


class UnknownFormat(Unanswerable, kind="unknown-format"):
    """The format does not exist."""


class InvalidField(Unanswerable, kind="invalid-field"):
    """A control or another field is missing, unknown or out of range."""


class OutsideSamples(Unanswerable, kind="outside-samples"):
    """The controls are not supported by the samples, and `extrapolate` is "refuse"."""


class OutOfReach(Unanswerable, kind="out-of-reach"):
    """The motion cannot meet a target, and the request does not allow the nearest solution."""


class Busy(Problem):
    """The service, or a gateway, cannot respond now."""

    again = True


class Overloaded(Busy, kind="overloaded"):
    """The service is overloaded."""


class Late(Busy, kind="late"):
    """The service exceeded its own time limit."""


class NotReady(Busy, kind="not-ready"):
    """The service is not ready for requests."""


class InternalError(Problem, kind="internal-error"):
    """The service failed; its log has the cause under `instance`."""


class Unreachable(PosefieldError):
    """No service responds at the address."""

    again = True


class TimedOut(PosefieldError):
    """The response exceeded the timeout."""

    again = True


class Broken(PosefieldError):
    """The response was interrupted."""

    again = True


class IncompleteAnswer(Broken):
    """The response ended, but is incomplete."""


class Unexpected(PosefieldError):
    """The response does not follow the contract of this client.

    service: the service's contract version; None if unknown. client: that of this client.
    """

    client: ClassVar[str] = CONTRACT
    service: str | None = None

    def __str__(self) -> str:
        version = f"contract {self.service}" if self.service else "an unknown contract"
        return f"{super().__str__()}; the service has {version}, this client {CONTRACT}"


_PROBLEM = msgspec.json.Decoder(generated.Problem)


def from_response(
    status: int, headers: Mapping[str, str], content: bytes, request: str
) -> PosefieldError:
    """Return the exception for an unsuccessful response. request: method and path."""
    error = _classified(status, headers, content, request)
    error.retry_after = _seconds(headers)
    return error


def _classified(
    status: int, headers: Mapping[str, str], content: bytes, request: str
) -> PosefieldError:
    kind = media_type(headers)
    try:
        if kind == MEDIA_TYPE:
            document = _PROBLEM.decode(content)
            # For an unknown type, the status still tells whether the problem is temporary.
            unknown = Busy if status in GATEWAYS else Problem
            return Problem.kinds.get(document.type.removeprefix(TYPE_PREFIX), unknown)(document)
    except msgspec.DecodeError as error:
        kind = f"no problem document: {error}"
    if status in GATEWAYS:
        return Unreachable(f"{request} was answered with {status}, and not by the service")
    if "location" in headers:
        return Unexpected(f"{request} was redirected to {headers['location']} ({status})")
    return Unexpected(f"{request} was answered with {status} and {kind}")


def media_type(headers: Mapping[str, str]) -> str:
    """Return the media type of a response, without its parameters."""
    return headers.get("content-type", "").partition(";")[0].strip() or "no media type"


def _seconds(headers: Mapping[str, str]) -> float | None:
    """Return the seconds of a Retry-After header; None without a valid one.

    A date is compared with the response's own Date header, because clocks differ.
    """
    text = headers.get("retry-after", "")
    if text.isascii() and text.isdigit():
        return float(text)
    date, now = _timestamp(text), _timestamp(headers.get("date", ""))
    return max(0.0, date - (time.time() if now is None else now)) if date is not None else None


def _timestamp(text: str) -> float | None:
    try:
        return parsedate_to_datetime(text).timestamp()
    except (ValueError, OverflowError):
        return None
