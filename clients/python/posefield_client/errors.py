"""What can go wrong, as one tree.

PosefieldError
├── WrongQuestion              nothing was sent: a name, ending or number that cannot be
├── Problem                    the service says what is wrong; itself, of a kind still unknown
│   ├── WrongRequest           the request breaks the contract
│   │   ├── BadParameter, BadBody, MalformedRequest, UnsupportedMediaType, NotAcceptable,
│   │   ├── NoSuchPath, MethodNotAllowed,
│   │   └── BodyTooLarge, UrlTooLong, HeadTooLarge, RequestTooSlow
│   ├── NotAllowed             the key
│   │   └── Unauthenticated, Forbidden
│   ├── Unanswerable           there is no answer to this question
│   │   └── UnknownModel, UnknownFormat, InvalidField, OutsideSamples,
│   │       OutOfReach
│   ├── Busy                   asked again by itself, until patience ends
│   │   └── Overloaded, Late, NotReady, NoConnectionLeft
│   └── InternalError          the service failed
├── Unreachable                no service answers; asked again by itself
├── TimedOut                   it took too long; asked again by itself
├── Broken                     the answer was cut in its middle; asked again by itself
│   └── IncompleteAnswer       it ended, but is not whole
└── Unexpected                 this is no answer of the contract that this client knows
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
"""Statuses by which something before the service says that it is not there now."""


class PosefieldError(Exception):
    """Whatever this client raises on purpose."""

    again: ClassVar[bool] = False
    """Whether the same question may have an answer later."""
    retry_after: float | None = None
    """Seconds after which the service wants to be asked again."""


class WrongQuestion(PosefieldError, ValueError):
    """Nothing was sent: what is asked for cannot be."""


class Problem(PosefieldError):
    """The service says what is wrong, by a document of RFC 9457.

    status: of HTTP; kind: the last part of `type`; title, detail: for people; instance: the
    request's id, which the service's log has; errors: where in the request the fault lies.
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
        # From worker to caller: an exception is made anew from what it was made of.
        return type(self), (self.said, self.retry_after), vars(self)


class WrongRequest(Problem):
    """The request breaks the contract."""


class BadParameter(WrongRequest, kind="bad-parameter"):
    """A query parameter cannot be read."""


class BadBody(WrongRequest, kind="bad-body"):
    """The body cannot be read."""


class MalformedRequest(WrongRequest, kind="malformed-request"):
    """What arrived was not HTTP as the service reads it."""


class UnsupportedMediaType(WrongRequest, kind="unsupported-media-type"):
    """The body must be JSON."""


class NotAcceptable(WrongRequest, kind="not-acceptable"):
    """Nothing that is accepted is there."""


class NoSuchPath(WrongRequest, kind="no-such-path"):
    """Nothing lies at this path: the address is another's, or the service is older."""


class MethodNotAllowed(WrongRequest, kind="method-not-allowed"):
    """The path does not take this method."""


class BodyTooLarge(WrongRequest, kind="body-too-large"):
    """The question is larger than the service accepts."""


class UrlTooLong(WrongRequest, kind="url-too-long"):
    """The URL is longer than the service accepts."""


class HeadTooLarge(WrongRequest, kind="head-too-large"):
    """The request's head is larger than the service accepts."""


class RequestTooSlow(WrongRequest, kind="request-too-slow"):
    """The request took too long to arrive."""


class NotAllowed(Problem):
    """The key does not do."""


class Unauthenticated(NotAllowed, kind="unauthenticated"):
    """The service wants a key, and there is none, or one that does not hold."""


class Forbidden(NotAllowed, kind="forbidden"):
    """The key may not do this."""


class Unanswerable(Problem):
    """The question is well said, and has no answer."""


class UnknownModel(Unanswerable, kind="unknown-model"):
    """No model of that name, or none that the key may read."""


class UnknownFormat(Unanswerable, kind="unknown-format"):
    """No format of that name."""


class InvalidField(Unanswerable, kind="invalid-field"):
    """A control or another field is missing, unknown or out of range."""


class OutsideSamples(Unanswerable, kind="outside-samples"):
    """Nothing like the controls was captured, and `extrapolate` is "refuse"."""


class OutOfReach(Unanswerable, kind="out-of-reach"):
    """The motion cannot meet a target, and was not to come as near as it can."""


class Busy(Problem):
    """The service, or what stands before it, cannot answer now."""

    again = True


class Overloaded(Busy, kind="overloaded"):
    """The service has too much to do."""


class Late(Busy, kind="late"):
    """The answer took the service too long."""


class NotReady(Busy, kind="not-ready"):
    """The service should not be asked now."""


class NoConnectionLeft(Busy, kind="no-connection-left"):
    """The service has no connection left."""


class InternalError(Problem, kind="internal-error"):
    """The service failed; its log says how, under `instance`."""


class Unreachable(PosefieldError):
    """No service answers at the address."""

    again = True


class TimedOut(PosefieldError):
    """No answer in time."""

    again = True


class Broken(PosefieldError):
    """The answer was cut in its middle."""

    again = True


class IncompleteAnswer(Broken):
    """The answer ended, but is not whole."""


class Unexpected(PosefieldError):
    """This is no answer of the contract that this client knows.

    found: what came instead; service: the version of the contract that the service says it speaks,
    None where it says none; client: the one that this client was made for.
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
    """Error that an answer other than a good one means; asked: for what, in words."""
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
    # Of a kind that is unknown, the status still says whether it may pass.
    unknown = Busy if status in GATEWAYS else Problem
    return Problem.kinds.get(said.type.removeprefix(TYPE_PREFIX), unknown)(said)


def media_type(headers: Mapping[str, str]) -> str:
    """What an answer says it is, without its parameters."""
    return headers.get("content-type", "").partition(";")[0].strip() or "no media type"


def _seconds(headers: Mapping[str, str]) -> float | None:
    """Of a Retry-After header; a date is held against the service's own, for clocks differ."""
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
