"""Access control: API keys, scopes, and the check of a request's credentials.

A key is 256 random bits, so one SHA-256 suffices: slow password hashes protect against guessing,
which is infeasible here. Each refusal is logged as one line of JSON with the name of the key or a
pseudonym of the token, the request id, the path template and the reason; it holds no key, no token,
no query and no value of a path parameter.
"""

import base64
import hashlib
import hmac
import ipaddress
import logging
import re
import secrets
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import orjson

from posefield.common.errors import FileError, InvalidField
from posefield.http.api.problems import FORBIDDEN, UNAUTHENTICATED, RequestError
from posefield.http.api.settings import PREFIX, Settings
from posefield.registry.model_registry import NAME, ModelRegistry

if TYPE_CHECKING:
    from posefield.http.access.bearer_tokens import TokenVerifier


KEY_PREFIX = "pf_"
"""Prefix of every key, by which secret scanners recognise a published one."""
READ = "read"
METRICS = "metrics"
_ALL = f"{READ}:*"
_NAME = re.compile(r"[A-Za-z0-9._-]{1,64}")
_DIGEST = re.compile(r"[0-9a-f]{64}")


class InvalidCredentials(Exception):
    """Error of invalid credentials; the message gives the reason and quotes no credentials."""


@dataclass(frozen=True)
class Principal:
    """A client and its permissions.

    name: in logs. models: names of the models it may read, None for all. metrics: it may read the
    metrics.
    """

    name: str
    models: frozenset[str] | None
    metrics: bool

    def may_read(self, model: str) -> bool:
        """Return True if the principal may read the model of that name."""
        return self.models is None or model in self.models

    def may(self, scope: str) -> bool:
        """Return True if the principal has the scope, READ (for at least one model) or METRICS."""
        return self.metrics if scope == METRICS else self.models is None or bool(self.models)


EVERYONE = Principal("everyone", None, True)
"""Principal of every request to a service without keys and tokens."""
NO_ACCESS = Principal("nobody", frozenset(), False)
"""Principal of a request without credentials."""


def from_scopes(name: str, scopes: Iterable[str]) -> Principal:
    """Return the principal of scopes `read:*`, `read:MODEL` and `metrics`; ignore others."""
    scope_set = frozenset(scopes)
    models = frozenset(s.removeprefix(f"{READ}:") for s in scope_set if s.startswith(f"{READ}:"))
    return Principal(name, None if _ALL in scope_set else models, METRICS in scope_set)


def _is_scope(text: str) -> bool:
    kind, _, model = text.partition(":")
    return text in (METRICS, _ALL) or (kind == READ and NAME.fullmatch(model) is not None)


@dataclass(frozen=True)
class ApiKeys:
    """Registered keys.

    principals: digests and principals, by the first 8 bytes of the digest.
    """

    principals: Mapping[bytes, tuple[bytes, Principal]]

    def find(self, key: str) -> Principal | None:
        """Return the principal of a key; None for an unknown key.

        Timing reveals no key: the look-up can reveal at most the first bytes of a digest, from
        which no key follows, and the whole digest is compared in constant time.
        """
        digest = hashlib.sha256(key.encode()).digest()
        registered, principal = self.principals.get(digest[:8], (b"", None))
        return principal if hmac.compare_digest(registered, digest) else None


def generate_key() -> str:
    """Return a new random key."""
    return KEY_PREFIX + base64.urlsafe_b64encode(secrets.token_bytes(32)).rstrip(b"=").decode()


def key_line(name: str, scopes: Iterable[str], key: str) -> str:
    """Return the line that registers a key with the service: `NAME SHA256 SCOPE...`.

    Raises InvalidField for an invalid name or scope.
    """
    if not _NAME.fullmatch(name):
        raise InvalidField("name", f"{name!r}, expected {_NAME.pattern}")
    text = " ".join((name, hashlib.sha256(key.encode()).hexdigest(), *scopes))
    _parse_line(text, "key")
    return text


def parse_keys(text: str, field: str) -> ApiKeys:
    """Return the keys of a text with one key per line; `;` also separates, `#` begins a comment.

    field: name of the source in messages. Raises InvalidField for an invalid line and for two keys
    of one name; the message gives the line's number and quotes at most the key's name.
    """
    principals: dict[bytes, tuple[bytes, Principal]] = {}
    names: set[str] = set()
    for number, words in enumerate(re.split(r"[\n;]", text), start=1):
        if not words.partition("#")[0].strip():
            continue
        digest, principal = _parse_line(words.partition("#")[0], f"{field}:{number}")
        if principal.name in names:
            raise InvalidField(f"{field}:{number}", f"a second key named {principal.name!r}")
        names.add(principal.name)
        principals[digest[:8]] = digest, principal
    return ApiKeys(principals)


def _parse_line(text: str, where: str) -> tuple[bytes, Principal]:
    # Messages do not quote the digest: an operator may have put the key itself in its place.
    name, digest, *scopes = (*text.split(), "", "")
    scopes = list(filter(None, scopes))
    if not _NAME.fullmatch(name):
        raise InvalidField(where, f"its name, expected {_NAME.pattern}")
    if not _DIGEST.fullmatch(digest):
        raise InvalidField(where, f"the hash of {name!r}, expected 64 lower-case hex digits")
    if not scopes or not all(map(_is_scope, scopes)):
        raise InvalidField(
            where, f"the scopes of {name!r}, expected some of read:*, read:MODEL, metrics"
        )
    return bytes.fromhex(digest), from_scopes(name, scopes)


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
