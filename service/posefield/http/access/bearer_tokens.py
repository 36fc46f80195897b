"""Bearer tokens (JWT, RFC 7519) of an issuer that the operator trusts, verified by PyJWT.

The settings fix one algorithm, one issuer and one audience. Of the token's header only the key id
is used, which selects among the issuer's known keys.
"""

import contextlib
import hashlib
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
from posefield.http.access import api_keys
from posefield.http.access.api_keys import InvalidCredentials, Principal
from posefield.http.api.settings import Settings

log = logging.getLogger(__name__)

# 9999-12-31T23:59:59Z, the last second that RFC 3339 can represent.
LATEST_TIME = 253_402_300_799
REFRESH_COOLDOWN = 10.0
"""Minimum time between two reads of the source, s: unknown key ids cannot cause more reads."""
_TIMEOUT = 5.0
_LOOPBACK = ("127.0.0.1", "localhost", "::1")
_SOURCE_ERRORS = (jwt.PyJWTError, OSError, ValueError, RecursionError)
# Beside PyJWT's own errors: signed tokens can hold deeply nested JSON, claims of another type,
# times out of range and unpaired surrogates.
_TOKEN_ERRORS = (jwt.PyJWTError, RecursionError, OverflowError, TypeError, ValueError)
_REASONS: dict[type[Exception], str] = {
    jwt.ExpiredSignatureError: "expired",
    jwt.ImmatureSignatureError: "not valid yet",
    jwt.InvalidAudienceError: "meant for another audience",
    jwt.InvalidIssuerError: "of another issuer",
    jwt.InvalidSignatureError: "its signature is wrong",
    jwt.InvalidAlgorithmError: "signed by another algorithm",
    jwt.MissingRequiredClaimError: "without one of exp, iss, aud",
}

PublicKeys = Mapping[str | None, jwt.PyJWK]


class _Document(msgspec.Struct):
    """A JSON Web Key Set (RFC 7517); its other members are ignored."""

    keys: list[dict[str, Any]]


@dataclass
class KeySet:
    """Public keys of a source for one algorithm, by `kid`; read at start, refreshed by `watch`.

    PyJWKClient's own cache would fetch in the thread that looks a key up, here the event loop's,
    and is empty once it has expired while the issuer is down.

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
        key = next(iter(keys.values())) if kid is None and len(keys) == 1 else keys.get(kid)
        if key is None:
            self._unknown.set()
        return key

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
            keys = {key.key_id: key for key in self._usable(_read_document(self.source))}
        except _SOURCE_ERRORS as fault:
            raise FileError(self.source, f"no key set: {fault!r}") from fault
        if not keys:
            raise FileError(self.source, f"no public key for {self.algorithm}, expected one")
        return keys

    def _usable(self, document: _Document) -> Iterator[jwt.PyJWK]:
        for entry in document.keys:
            signs = entry.get("use", "sig") == "sig"
            if signs and entry.get("alg", self.algorithm) == self.algorithm:
                # Key sets may also hold keys of other types.
                with contextlib.suppress(jwt.PyJWTError):
                    yield jwt.PyJWK.from_dict(entry, self.algorithm)


def _read_document(source: str) -> _Document:
    url = urlsplit(source)
    if not url.scheme:
        return msgspec.json.decode(Path(source).read_bytes(), type=_Document)
    if url.scheme != "https" and not (url.scheme == "http" and url.hostname in _LOOPBACK):
        raise ValueError(f"{url.scheme}://{url.hostname}, expected https")
    # The client follows no redirect: the operator has approved this address only.
    client = jwt.PyJWKClient(source, cache_jwk_set=False, timeout=_TIMEOUT)
    return msgspec.convert(client.fetch_data(), _Document)


@dataclass(frozen=True)
class TokenVerifier:
    """Verifier of the tokens of one issuer."""

    settings: Settings
    keys: KeySet

    def find(self, token: str) -> Principal:
        """Return the principal of a token; raises InvalidCredentials for an invalid one."""
        try:
            claims = self._claims(token)
            # The subject may be personal data: logs get a hash.
            subject = f"{claims['iss']}\n{claims.get('sub', '')}".encode()
            name = f"token-{hashlib.sha256(subject).hexdigest()[:12]}"
        except _TOKEN_ERRORS as fault:
            reason = _REASONS.get(type(fault), "not a token that can be verified")
            raise InvalidCredentials(reason) from None
        return api_keys.from_scopes(name, _scopes(claims.get(self.settings.jwt_scopes)))

    def _claims(self, token: str) -> Mapping[str, Any]:
        key = self.keys.find(jwt.get_unverified_header(token).get("kid"))
        if key is None:
            raise InvalidCredentials("signed by a key that is not known")
        claims = jwt.decode(
            token,
            key,
            algorithms=[self.settings.jwt_algorithm],
            audience=self.settings.jwt_audience,
            issuer=self.settings.jwt_issuer,
            leeway=self.settings.jwt_leeway,
            options={"require": ["exp", "iss", "aud"]},
        )
        # PyJWT accepts text, Booleans and large numbers, which RFC 7519 does not.
        end = claims["exp"]
        if isinstance(end, bool) or not isinstance(end, int | float) or end > LATEST_TIME:
            raise ValueError(f"exp is {type(end).__name__}, expected a number up to {LATEST_TIME}")
        return claims


def from_settings(settings: Settings) -> TokenVerifier:
    """Return the verifier of the settings, and start the thread that refreshes its keys.

    Raises FileError for an unusable source of keys.
    """
    keys = KeySet(settings.jwt_keys, settings.jwt_algorithm)
    threading.Thread(target=keys.watch, args=(settings.jwt_refresh,), daemon=True).start()
    return TokenVerifier(settings, keys)


def _scopes(claim: object) -> list[str]:
    """Return the scopes of a claim: a string (RFC 8693) or a list of strings."""
    if isinstance(claim, str):
        return claim.split()
    return [word for word in claim if isinstance(word, str)] if isinstance(claim, list) else []
