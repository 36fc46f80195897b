"""API keys: made here, shown once, and known afterwards only by their hash.

A key is 256 random bits, so one SHA-256 is as good a hash as a slow one: slowness protects words
that people choose, which can be guessed; nobody guesses 256 bits.
"""

import base64
import hashlib
import hmac
import re
import secrets
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from service.motion.errors import InvalidField
from service.web.access import principal
from service.web.access.principal import Principal

PREFIX = "pf_"
"""What every key begins with, so that scanners find one that was published."""

_NAME = re.compile(r"[A-Za-z0-9._-]{1,64}")
_DIGEST = re.compile(r"[0-9a-f]{64}")


@dataclass(frozen=True)
class Known:
    """A key as the service knows it."""

    digest: bytes
    principal: Principal


@dataclass(frozen=True)
class Keys:
    """The keys that there are, by the first bytes of their hashes."""

    known: Mapping[bytes, Known]

    def find(self, key: str) -> Principal | None:
        """Who a key belongs to, in a time that tells nothing of any key.

        How long it takes to find the first bytes of a hash tells at most those, and no key follows
        from them; the rest is compared in constant time.
        """
        digest = hashlib.sha256(key.encode()).digest()
        known = self.known.get(digest[:8])
        if known is None or not hmac.compare_digest(known.digest, digest):
            return None
        return known.principal


def make() -> str:
    """A new key."""
    return PREFIX + base64.urlsafe_b64encode(secrets.token_bytes(32)).rstrip(b"=").decode()


def line(name: str, scopes: Iterable[str], key: str) -> str:
    """What the service has to know of a key: `NAME SHA256 SCOPE...`.

    Raises InvalidField for a name or scope that cannot be one.
    """
    if not _NAME.fullmatch(name):
        raise InvalidField("name", f"{name!r}, expected {_NAME.pattern}")
    text = " ".join((name, hashlib.sha256(key.encode()).hexdigest(), *scopes))
    _of_line(text, "key")
    return text


def read(text: str, field: str) -> Keys:
    """Keys of lines, or of what stands between semicolons; `#` begins a comment.

    Raises InvalidField, which names the field and the line but never repeats it, for a line that is
    none and for a second key of one name.
    """
    known: dict[bytes, Known] = {}
    names: set[str] = set()
    for where, words in _lines(text, field):
        key = _of_line(words, where)
        if key.principal.name in names:
            raise InvalidField(where, f"a second key named {key.principal.name!r}")
        names.add(key.principal.name)
        known[key.digest[:8]] = key
    return Keys(known)


def _lines(text: str, field: str) -> Iterator[tuple[str, str]]:
    for number, line in enumerate(re.split(r"[\n;]", text), start=1):
        if words := line.partition("#")[0].strip():
            yield f"{field}:{number}", words


def _of_line(text: str, where: str) -> Known:
    # Not repeated in messages: whoever mixes the two up has put a key here instead of its hash.
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
    return Known(bytes.fromhex(digest), principal.of(name, scopes))
