"""Access control: the check of a request's credentials and scopes.

Each refusal is logged as one line of JSON with the name of the key or a
pseudonym of the token, the request id, the path template and the reason; it holds no key, no token,
no query and no value of a path parameter.
"""

import ipaddress
import logging
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import orjson

from posefield.common.errors import FileError, InvalidField
from posefield.http.access.api_keys import (
    EVERYONE,
    KEY_PREFIX,
    METRICS,
    NO_ACCESS,
    ApiKeys,
    InvalidCredentials,
    Principal,
    parse_keys,
)
from posefield.http.api.problems import FORBIDDEN, UNAUTHENTICATED, RequestError
from posefield.http.api.settings import PREFIX, Settings
from posefield.registry.model_registry import ModelRegistry

if TYPE_CHECKING:
    from posefield.http.access.bearer_tokens import TokenVerifier


log = logging.getLogger(__name__)

Headers = Iterable[tuple[bytes, bytes]]

ALGORITHMS = (
    *("RS256", "RS384", "RS512", "PS256", "PS384", "PS512"),
    *("ES256", "ES384", "ES512", "EdDSA"),
)
"""Accepted signature algorithms, all asymmetric: a shared secret could also issue tokens."""
_SCHEME = "bearer "


@dataclass(frozen=True)
class AccessPolicy:
    """Accepted credentials; without any, every request is allowed.

    keys: API keys. tokens: verifier of bearer tokens, None without an issuer. metrics_open: the
    metrics need no credentials.
    """

    keys: ApiKeys
    tokens: "TokenVerifier | None"
    metrics_open: bool

    @cached_property
    def requires_credentials(self) -> bool:
        """True if requests need credentials."""
        return bool(self.keys.principals) or self.tokens is not None


class AuditedRequest(NamedTuple):
    """A request in the audit log.

    request: its id. method: HTTP method. path: path template of the contract, not the requested
    path.
    """

    request: str
    method: str
    path: str


def from_settings(settings: Settings) -> AccessPolicy:
    """Return the policy of the settings.

    Raises InvalidField and FileError for invalid keys or an unusable source of keys, and
    InvalidField if the service would listen beyond loopback without credentials, which the setting
    `open` allows.
    """
    text, source = settings.keys, f"{PREFIX}KEYS"
    if settings.keys_file:
        source = settings.keys_file
        try:
            text = f"{Path(source).read_text('utf-8')}\n{text}"
        except (OSError, UnicodeDecodeError) as fault:
            raise FileError(source, f"no file of keys: {fault}") from fault
    keys = parse_keys(text, source)
    policy = AccessPolicy(keys, _token_verifier(settings), settings.metrics_open)
    if not (policy.requires_credentials or settings.open or _is_loopback(settings.host)):
        raise InvalidField(
            f"{PREFIX}HOST",
            f"{settings.host!r} lets everybody ask who reaches it; expected {PREFIX}KEYS_FILE, "
            f"{PREFIX}KEYS or {PREFIX}JWT_KEYS, or {PREFIX}OPEN=1 to say that this is wanted",
        )
    return policy


def _is_loopback(host: str) -> bool:
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _token_verifier(settings: Settings) -> "TokenVerifier | None":
    """Return the verifier of tokens, None where the settings name no issuer."""
    needed = {
        "JWT_KEYS": settings.jwt_keys,
        "JWT_ISSUER": settings.jwt_issuer,
        "JWT_AUDIENCE": settings.jwt_audience,
    }
    if not any(needed.values()):
        return None
    for name, value in needed.items():
        if not value:
            raise InvalidField(PREFIX + name, f"missing; tokens need all of {', '.join(needed)}")
    if settings.jwt_algorithm not in ALGORITHMS:
        raise InvalidField(
            f"{PREFIX}JWT_ALGORITHM",
            f"{settings.jwt_algorithm!r}, expected one of {', '.join(ALGORITHMS)}",
        )
    # Imported here since its libraries are an optional dependency.
    from posefield.http.access import bearer_tokens

    return bearer_tokens.from_settings(settings)


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
        principal = _authenticate(policy, _credentials(headers))
    except InvalidCredentials as fault:
        _log_refusal(call, UNAUTHENTICATED.status, NO_ACCESS, str(fault))
        # RFC 6750, 3.1: a challenge to a request without credentials has no error code.
        error = "" if str(fault) == "no Authorization" else ', error="invalid_token"'
        raise RequestError(
            UNAUTHENTICATED,
            f"{fault}; expected a key or token that is known",
            headers={"WWW-Authenticate": f'Bearer realm="posefield"{error}'},
        ) from None
    if not principal.may(scope):
        _log_refusal(call, FORBIDDEN.status, principal, f"has no scope {scope}")
        challenge = f'Bearer realm="posefield", error="insufficient_scope", scope="{scope}"'
        detail = f"the key or token has no scope {scope!r} for anything"
        raise RequestError(FORBIDDEN, detail, headers={"WWW-Authenticate": challenge})
    return principal


def readable_library(
    library: ModelRegistry, principal: Principal, key: str | None, call: AuditedRequest
) -> ModelRegistry:
    """Return the library restricted to the models that the principal may read.

    key: of the model in the request's path, if any; the audit log gets a line if the principal may
    not read it. Forbidden and unknown models get the same response (404), so that requests cannot
    probe for names.
    """
    if principal.models is None:
        return library
    if key is not None and not principal.may_read(name := key.partition("@")[0]):
        logged_name = name if name in library.models else "unknown"
        _log_refusal(call, 404, principal, f"may not read model {logged_name}")
    return library.restricted_to(principal.may_read)


def _authenticate(policy: AccessPolicy, credentials: str) -> Principal:
    if policy.tokens is not None and not credentials.startswith(KEY_PREFIX):
        return policy.tokens.find(credentials)
    principal = policy.keys.find(credentials)
    if principal is None:
        raise InvalidCredentials("no such key")
    return principal


def _credentials(headers: Headers) -> str:
    values = [value for name, value in headers if name == b"authorization"]
    if len(values) != 1:
        raise InvalidCredentials("more than one Authorization" if values else "no Authorization")
    text = values[0].decode("latin-1")
    if text[: len(_SCHEME)].lower() != _SCHEME:
        raise InvalidCredentials("Authorization of another scheme, expected Bearer")
    return text[len(_SCHEME) :].strip()


def _log_refusal(call: AuditedRequest, status: int, principal: Principal, reason: str) -> None:
    fields = {"status": status, **call._asdict(), "who": principal.name, "why": reason}
    log.warning("%s", orjson.dumps({"audit": "refused", **fields}).decode())
