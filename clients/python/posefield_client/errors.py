"""Exceptions of the client, as one tree.

PosefieldError
├── WrongQuestion              invalid argument: a name, format or number; nothing was sent
├── Problem                    problem document of the service; itself for an unknown type
│   ├── WrongRequest           the request violates the contract
│   │   ├── BadParameter, BadBody, UnsupportedMediaType, NotAcceptable,
│   │   ├── NoSuchPath, MethodNotAllowed,
│   │   └── BodyTooLarge, UrlTooLong, HeadTooLarge, UnknownHost
│   ├── NotAllowed             the key was refused
│   │   └── Unauthenticated, Forbidden
│   ├── Unanswerable           a valid request without a result
│   │   └── UnknownModel, UnknownFormat, InvalidField, OutsideSamples,
│   │       OutOfReach
│   ├── Busy                   temporary; retried
│   │   └── Overloaded, Late, NotReady
│   └── InternalError          the service failed
├── Unreachable                no service responds; retried
├── TimedOut                   the timeout was exceeded; retried
├── Broken                     the response was interrupted; retried
│   └── IncompleteAnswer       the response ended, but is incomplete
└── Unexpected                 the response does not follow the contract of this client
"""

import time
from collections.abc import Mapping
from email.utils import parsedate_to_datetime
from typing import Any, ClassVar

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

    def __init__(self, said: generated.Problem, retry_after: float | None = None) -> None:
        super().__init__(f"{said.title}: {said.detail}" if said.detail else said.title)
        self.said = said
        self.status = said.status
        self.kind = said.type.removeprefix(TYPE_PREFIX)
        self.title = said.title
        self.detail = said.detail
        self.instance = said.instance
        self.errors = said.errors
        self.retry_after = retry_after

    def __reduce__(self) -> tuple[Any, ...]:
        # Pickling between processes needs the arguments of the constructor.
        return type(self), (self.said, self.retry_after), vars(self)


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

    found: description of the response. service: the service's contract version; None if unknown.
    client: the contract version of this client.
    """

    client = CONTRACT

    def __init__(self, found: str, service: str | None = None) -> None:
        speaks = (
            f"speaks contract {service}" if service else "does not say which contract it speaks"
        )
        super().__init__(f"{found}; the service {speaks}, this client was made for {CONTRACT}")
        self.found = found
        self.service = service

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.found, self.service), vars(self)


_PROBLEM = msgspec.json.Decoder(generated.Problem)


def of_answer(
    status: int, headers: Mapping[str, str], content: bytes, asked: str
) -> PosefieldError:
    """Return the exception for an unsuccessful response. asked: the request, in words."""
    fault = _of_anything(status, headers, content, asked)
    fault.retry_after = _seconds(headers)
    return fault


def _of_anything(
    status: int, headers: Mapping[str, str], content: bytes, asked: str
) -> PosefieldError:
    problem = media_type(headers) == MEDIA_TYPE
    try:
        if problem:
            return _of_problem(status, _PROBLEM.decode(content))
    except msgspec.DecodeError as fault:
        if status not in GATEWAYS:
            told = f"{asked} was answered with {status} and no problem document: {fault}"
            return Unexpected(told)
    if status in GATEWAYS:
        return Unreachable(f"{asked} was answered with {status}, and not by the service")
    if "location" in headers:
        return Unexpected(f"{asked} was sent on to {headers['location']} ({status})")
    return Unexpected(f"{asked} was answered with {status} and {media_type(headers)}")


def _of_problem(status: int, said: generated.Problem) -> Problem:
    # For an unknown type, the status still tells whether the problem is temporary.
    unknown = Busy if status in GATEWAYS else Problem
    return Problem.kinds.get(said.type.removeprefix(TYPE_PREFIX), unknown)(said)


def media_type(headers: Mapping[str, str]) -> str:
    """Return the media type of a response, without its parameters."""
    return headers.get("content-type", "").partition(";")[0].strip() or "no media type"


def _seconds(headers: Mapping[str, str]) -> float | None:
    """Return the seconds of a Retry-After header; None without one.

    A date is compared with the response's own Date header, because clocks differ.
    """
    text = headers.get("retry-after", "")
    if text.isascii() and text.isdigit():
        return float(text)
    said, now = _moment(text), _moment(headers.get("date", ""))
    return max(0.0, said - (time.time() if now is None else now)) if said is not None else None


def _moment(text: str) -> float | None:
    try:
        return parsedate_to_datetime(text).timestamp()
    except (ValueError, OverflowError):
        return None
