"""The door: lets a request in, or says why not and writes it down."""

from collections.abc import Iterable

from service.synthesis.library import Library
from service.web.access import audit
from service.web.access.audit import Call
from service.web.access.keys import PREFIX as KEY
from service.web.access.policy import Policy, Rejected
from service.web.access.principal import EVERYONE, METRICS, NOBODY, Principal
from service.web.problems import FORBIDDEN, UNAUTHENTICATED, RequestFault

Headers = Iterable[tuple[bytes, bytes]]

_SCHEME = "bearer "


def check(policy: Policy, headers: Headers, scope: str | None, call: Call) -> Principal:
    """Who asks for something that needs a scope (None: nothing); raises RequestFault 401 or 403."""
    if not policy.closed:
        return EVERYONE
    if scope is None or (scope == METRICS and policy.metrics_open):
        return NOBODY
    try:
        found = _found(policy, headers)
    except Rejected as fault:
        audit.refused(call, UNAUTHENTICATED.status, NOBODY.name, str(fault))
        raise _unauthenticated(str(fault)) from None
    if not found.may(scope):
        audit.refused(call, FORBIDDEN.status, found.name, f"has no scope {scope}")
        raise _forbidden(scope)
    return found


def seen(library: Library, principal: Principal, asked: str | None, call: Call) -> Library:
    """The library as somebody sees it: what they may not read does not exist.

    Forbidden and unknown models are answered alike, so that nobody learns names by asking.
    """
    if principal.models is None:
        return library
    if asked is not None and not principal.may_read(name := asked.partition("@")[0]):
        known = name if name in library.models else "unknown"
        audit.refused(call, 404, principal.name, f"may not read model {known}")
    return library.of(principal.may_read)


def _found(policy: Policy, headers: Headers) -> Principal:
    credentials = _credentials(headers)
    if credentials.startswith(KEY) or policy.tokens is None:
        if found := policy.keys.find(credentials):
            return found
        raise Rejected("no such key")
    return policy.tokens.find(credentials)


def _credentials(headers: Headers) -> str:
    given = [value for name, value in headers if name == b"authorization"]
    if len(given) != 1:
        raise Rejected("more than one Authorization" if given else "no Authorization")
    text = given[0].decode("latin-1")
    if text[: len(_SCHEME)].lower() != _SCHEME:
        raise Rejected("Authorization of another scheme, expected Bearer")
    return text[len(_SCHEME) :].strip()


def _unauthenticated(why: str) -> RequestFault:
    # RFC 6750, 3.1: without credentials there is no error to name.
    error = "" if why == "no Authorization" else ', error="invalid_token"'
    challenge = {"WWW-Authenticate": f'Bearer realm="posefield"{error}'}
    return RequestFault(
        UNAUTHENTICATED, f"{why}; expected a key or token that is known", headers=challenge
    )


def _forbidden(scope: str) -> RequestFault:
    challenge = f'Bearer realm="posefield", error="insufficient_scope", scope="{scope}"'
    detail = f"the key or token has no scope {scope!r} for anything"
    return RequestFault(FORBIDDEN, detail, headers={"WWW-Authenticate": challenge})
