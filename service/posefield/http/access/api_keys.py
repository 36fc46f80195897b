"""API keys: generation, and verification by their SHA-256 hashes.

A key is 256 random bits, so one SHA-256 suffices: slow password hashes protect against guessing,
which is infeasible here.
"""

import base64
import hashlib
import hmac
import re
import secrets
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from posefield.common.errors import InvalidField
from posefield.http.access import principal
from posefield.http.access.principal import Principal

KEY_PREFIX = "pf_"
"""Prefix of every key, by which secret scanners recognise a published one."""

_NAME = re.compile(r"[A-Za-z0-9._-]{1,64}")
_DIGEST = re.compile(r"[0-9a-f]{64}")


@dataclass(frozen=True)
class RegisteredKey:
    """A registered key: its SHA-256 digest and its principal."""

    digest: bytes
    principal: Principal


@dataclass(frozen=True)
class ApiKeys:
    """Registered keys.

    known: by the first 8 bytes of their digests.
    """

    known: Mapping[bytes, RegisteredKey]

    def find(self, key: str) -> Principal | None:
        """Return the principal of a key; None for an unknown key.

        Timing reveals no key: the look-up can reveal at most the first bytes of a digest, from
        which no key follows, and the whole digest is compared in constant time.
        """
        digest = hashlib.sha256(key.encode()).digest()
        known = self.known.get(digest[:8])
        if known is None or not hmac.compare_digest(known.digest, digest):
            return None
        return known.principal


def generate_key() -> str:
    """Return a new random key."""
    return KEY_PREFIX + base64.urlsafe_b64encode(secrets.token_bytes(32)).rstrip(b"=").decode()


def line(name: str, scopes: Iterable[str], key: str) -> str:
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
    known: dict[bytes, RegisteredKey] = {}
    names: set[str] = set()
    for where, words in _lines(text, field):
        key = _parse_line(words, where)
        if key.principal.name in names:
            raise InvalidField(where, f"a second key named {key.principal.name!r}")
        names.add(key.principal.name)
        known[key.digest[:8]] = key
    return ApiKeys(known)


def _lines(text: str, field: str) -> Iterator[tuple[str, str]]:
    for number, line in enumerate(re.split(r"[\n;]", text), start=1):
        if words := line.partition("#")[0].strip():
            yield f"{field}:{number}", words


def _parse_line(text: str, where: str) -> RegisteredKey:
    # Messages do not quote the digest: an operator may have put the key itself in its place.
    name, digest, *scopes = (*text.split(), "", "")
    scopes = list(filter(None, scopes))
    if not _NAME.fullmatch(name):
        raise InvalidField(where, f"its name, expected {_NAME.pattern}")
    if not _DIGEST.fullmatch(digest):
        raise InvalidField(where, f"the hash of {name!r}, expected 64 lower-case hex digits")
    if not scopes or not all(principal.is_scope(scope) for scope in scopes):
        raise InvalidField(
            where, f"the scopes of {name!r}, expected some of read:*, read:MODEL, metrics"
        )
    return RegisteredKey(bytes.fromhex(digest), principal.from_scopes(name, scopes))
