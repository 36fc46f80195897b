"""Access control: checks the credentials of a request, and logs refusals in the audit log."""

from collections.abc import Iterable

from posefield.http.access import audit
from posefield.http.access.access_policy import AccessPolicy
from posefield.http.access.api_keys import KEY_PREFIX as KEY
from posefield.http.access.audit import AuditedRequest
from posefield.http.access.principal import (
    EVERYONE,
    METRICS,
    NO_ACCESS,
    InvalidCredentials,
    Principal,
)
from posefield.http.api.problems import FORBIDDEN, UNAUTHENTICATED, RequestError
from posefield.registry.model_registry import ModelRegistry

Headers = Iterable[tuple[bytes, bytes]]

_SCHEME = "bearer "


def authorize(
    policy: AccessPolicy, headers: Headers, scope: str | None, call: AuditedRequest
) -> Principal:
    """Return the principal of a request.

    scope: the scope that the operation requires; None where it requires none. Raises RequestError
    401 for missing or invalid credentials, and 403 for credentials without the scope.
    """
    if not policy.requires_credentials:
        return EVERYONE
    if scope is None or (scope == METRICS and policy.metrics_open):
        return NO_ACCESS
    try:
        found = _authenticate(policy, headers)
    except InvalidCredentials as fault:
        audit.log_refusal(call, UNAUTHENTICATED.status, NO_ACCESS.name, str(fault))
        raise _unauthenticated(str(fault)) from None
    if not found.may(scope):
        audit.log_refusal(call, FORBIDDEN.status, found.name, f"has no scope {scope}")
        raise _forbidden(scope)
    return found


def readable_library(
    library: ModelRegistry, principal: Principal, asked: str | None, call: AuditedRequest
) -> ModelRegistry:
    """Return the library restricted to the models that the principal may read.

    asked: the model key in the request's path, if any; the audit log gets a line if the principal
    may not read it. Forbidden and unknown models get the same response (404), so that requests
    cannot probe for names.
    """
    if principal.models is None:
        return library
    if asked is not None and not principal.may_read(name := asked.partition("@")[0]):
        known = name if name in library.models else "unknown"
        audit.log_refusal(call, 404, principal.name, f"may not read model {known}")
    return library.restricted_to(principal.may_read)


def _authenticate(policy: AccessPolicy, headers: Headers) -> Principal:
    credentials = _credentials(headers)
    if credentials.startswith(KEY) or policy.tokens is None:
        if found := policy.keys.find(credentials):
            return found
        raise InvalidCredentials("no such key")
    return policy.tokens.find(credentials)


def _credentials(headers: Headers) -> str:
    given = [value for name, value in headers if name == b"authorization"]
    if len(given) != 1:
        raise InvalidCredentials("more than one Authorization" if given else "no Authorization")
    text = given[0].decode("latin-1")
    if text[: len(_SCHEME)].lower() != _SCHEME:
        raise InvalidCredentials("Authorization of another scheme, expected Bearer")
    return text[len(_SCHEME) :].strip()


def _unauthenticated(why: str) -> RequestError:
    # RFC 6750, 3.1: a challenge to a request without credentials has no error code.
    error = "" if why == "no Authorization" else ', error="invalid_token"'
    challenge = {"WWW-Authenticate": f'Bearer realm="posefield"{error}'}
    return RequestError(
        UNAUTHENTICATED, f"{why}; expected a key or token that is known", headers=challenge
    )


def _forbidden(scope: str) -> RequestError:
    challenge = f'Bearer realm="posefield", error="insufficient_scope", scope="{scope}"'
    detail = f"the key or token has no scope {scope!r} for anything"
    return RequestError(FORBIDDEN, detail, headers={"WWW-Authenticate": challenge})
