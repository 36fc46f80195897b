"""Public keys of a token issuer: a JWKS (RFC 7517), read at start and refreshed by a thread."""

import contextlib
import logging
import threading
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import jwt
import msgspec

from posefield.common.errors import FileError

log = logging.getLogger(__name__)

# PyJWKClient's own cache fetches in the thread that looks a key up, here the event loop's, and is
# empty once it has expired while the issuer is down.
REFRESH_COOLDOWN = 10.0
"""Minimum time between two reads of the source, s: unknown key ids cannot cause more reads."""

_TIMEOUT = 5.0
_LOOPBACK = ("127.0.0.1", "localhost", "::1")
_SOURCE_ERRORS = (jwt.PyJWTError, OSError, ValueError, RecursionError)

PublicKeys = Mapping[str | None, jwt.PyJWK]


class _Document(msgspec.Struct):
    """A JSON Web Key Set; its other members are ignored."""

    keys: list[dict[str, Any]]


@dataclass
class KeySet:
    """Public keys of a source for one algorithm, by `kid`.

    source: path or URL of a key set. Raises FileError for a source that cannot be read, is no key
    set or has no key for the algorithm. A refresh that fails so keeps the previous keys.
    """

    source: str
    algorithm: str
    keys: PublicKeys = field(init=False)
    _unknown: threading.Event = field(init=False, default_factory=threading.Event)

    def __post_init__(self) -> None:
        self.keys = self._read()

    def find(self, kid: str | None) -> jwt.PyJWK | None:
        """Return the key of an id; without an id, the only key. None for an unknown key.

        An unknown key makes `watch` refresh the keys.
        """
        keys = self.keys
        found = next(iter(keys.values())) if kid is None and len(keys) == 1 else keys.get(kid)
        if found is None:
            self._unknown.set()
        return found

    def watch(self, seconds: float, cooldown: float = REFRESH_COOLDOWN) -> None:
        """Refresh the keys periodically, in a loop without end.

        seconds: period, shortened by a request for an unknown key. cooldown: minimum time between
        two reads, s.
        """
        while True:
            time.sleep(cooldown)
            self._unknown.wait(seconds - cooldown)
            self._unknown.clear()
            self.refresh()

    def refresh(self) -> None:
        """Read the source again; log a failure and keep the previous keys."""
        try:
            self.keys = self._read()
        except FileError as fault:
            log.warning("the keys stay as they are: %s", fault)

    def _read(self) -> PublicKeys:
        try:
            keys = dict(_keys_for_algorithm(_read_document(self.source), self.algorithm))
        except _SOURCE_ERRORS as fault:
            raise FileError(self.source, f"no key set: {fault!r}") from fault
        if not keys:
            raise FileError(self.source, f"no public key for {self.algorithm}, expected one")
        return keys


def _read_document(source: str) -> _Document:
    parts = urlsplit(source)
    if not parts.scheme:
        return msgspec.json.decode(Path(source).read_bytes(), type=_Document)
    if parts.scheme != "https" and not (parts.scheme == "http" and parts.hostname in _LOOPBACK):
        raise ValueError(f"{parts.scheme}://{parts.hostname}, expected https")
    # The client follows no redirect: the operator has approved this address only.
    client = jwt.PyJWKClient(source, cache_jwk_set=False, timeout=_TIMEOUT)
    return msgspec.convert(client.fetch_data(), _Document)


def _keys_for_algorithm(
    document: _Document, algorithm: str
) -> Iterator[tuple[str | None, jwt.PyJWK]]:
    for entry in document.keys:
        if entry.get("use", "sig") == "sig" and entry.get("alg", algorithm) == algorithm:
            # Key sets may also hold keys of other types.
            with contextlib.suppress(jwt.PyJWTError):
                key = jwt.PyJWK.from_dict(entry, algorithm)
                yield key.key_id, key
