"""The public keys of those who sign tokens: a JWKS of a file or an address, watched."""

import contextlib
import json
import logging
import threading
import urllib.request
from collections.abc import Iterable, Iterator, Mapping
from http.client import HTTPException
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import jwt

from service.motion.errors import FileError

log = logging.getLogger(__name__)

LIMIT = 1 << 20
"""Bytes of a JWKS: real ones have a few thousand."""

HURRY = 10.0
"""Least seconds between two looks: a client who names unknown keys makes the service look."""

_TIMEOUT = 5.0
_HERE = {("http", host) for host in ("127.0.0.1", "localhost", "::1")}


class _NoRedirect(urllib.request.HTTPRedirectHandler):
    """A redirect is a fault: the address was chosen by the operator, and no other is."""

    def redirect_request(self, *_: object) -> None:
        return None


_OPENER = urllib.request.build_opener(_NoRedirect)


def load(source: str, algorithm: str) -> dict[str | None, jwt.PyJWK]:
    """Keys by their `kid`, those of other algorithms and uses left out.

    Raises FileError for a source that cannot be read or holds no such key.
    """
    try:
        entries = json.loads(_content(source))["keys"]
        keys = dict(_usable(entries, algorithm))
    except (OSError, ValueError, KeyError, TypeError, AttributeError, HTTPException) as fault:
        raise FileError(source, f"no key set: {fault!r}") from fault
    if not keys:
        raise FileError(source, f"no public key for {algorithm}, expected at least one")
    return keys


def _usable(
    entries: Iterable[Mapping[str, Any]], algorithm: str
) -> Iterator[tuple[str | None, jwt.PyJWK]]:
    for entry in entries:
        if entry.get("use", "sig") == "sig" and entry.get("alg", algorithm) == algorithm:
            # Keys of other kinds stand beside them.
            with contextlib.suppress(jwt.PyJWTError):
                yield entry.get("kid"), jwt.PyJWK(dict(entry), algorithm)


def _content(source: str) -> bytes:
    parts = urlsplit(source)
    if not parts.scheme:
        return Path(source).read_bytes()
    if parts.scheme != "https" and (parts.scheme, parts.hostname) not in _HERE:
        raise ValueError(f"{parts.scheme}://{parts.hostname}, expected https")
    with _OPENER.open(source, timeout=_TIMEOUT) as answer:
        content: bytes = answer.read(LIMIT + 1)
    if len(content) > LIMIT:
        raise ValueError(f"more than {LIMIT} bytes")
    return content


class KeySet:
    """Keys of a source, replaced when it has others; what cannot be read changes nothing."""

    def __init__(self, source: str, algorithm: str, seconds: float) -> None:
        """Read the source once, then every so many seconds in a thread.

        Raises FileError as `load` does.
        """
        self.source, self.algorithm, self.seconds = source, algorithm, seconds
        self.keys: Mapping[str | None, jwt.PyJWK] = load(source, algorithm)
        self._unknown = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Begin to look again; the thread ends with the process."""
        if self._thread is None:
            self._thread = threading.Thread(target=self._watch, name="keys", daemon=True)
            self._thread.start()

    def find(self, kid: str | None) -> jwt.PyJWK | None:
        """Key of an id; without one, the only key there is. An unknown one is looked for."""
        keys = self.keys
        found = next(iter(keys.values())) if kid is None and len(keys) == 1 else keys.get(kid)
        if found is None:
            self._unknown.set()
        return found

    def _watch(self) -> None:
        pause = threading.Event()
        while True:
            pause.wait(HURRY)
            self._unknown.wait(max(self.seconds - HURRY, 0))
            self._unknown.clear()
            self.look()

    def look(self) -> None:
        """Read the source again."""
        try:
            self.keys = load(self.source, self.algorithm)
        except FileError as fault:
            log.warning("the keys stay as they are: %s", fault)
