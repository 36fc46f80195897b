"""API keys and principals: who asks, and the models that a principal may read.

A key is 256 random bits, so one SHA-256 suffices: slow password hashes protect against guessing,
which is infeasible here.
"""

import base64
import hashlib
import hmac
import re
import secrets
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from posefield.common.errors import InvalidField
from posefield.registry.model_registry import NAME

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
