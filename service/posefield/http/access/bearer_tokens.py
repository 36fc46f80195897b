"""Bearer tokens (JWT, RFC 7519) of an issuer that the operator trusts.

The settings fix one algorithm, one issuer and one audience. Of the token's header only the key id
is used, which selects among the issuer's known keys.
"""

import hashlib
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import jwt

from posefield.http.access import principal
from posefield.http.access.principal import InvalidCredentials, Principal
from posefield.http.access.token_keys import KeySet, PublicKeys
from posefield.http.api.settings import Settings

CACHE_SIZE = 10_000
"""Entries of the cache of verified tokens (2 MB); only valid tokens are cached."""

# 9999-12-31T23:59:59Z, the last second that RFC 3339 can represent.
LATEST_TIME = 253_402_300_799


@dataclass
class TokenVerifier:
    """Verifier of the tokens of one issuer; caches valid tokens until they expire.

    most: entries of the cache.
    """

    settings: Settings
    keys: KeySet
    most: int = CACHE_SIZE
    _valid: dict[bytes, tuple[float, Principal]] = field(init=False, default_factory=dict)
    _cached_keys: PublicKeys | None = field(init=False, default=None)

    def find(self, token: str) -> Principal:
        """Return the principal of a token; raises Rejected for an invalid one."""
        if self.keys.keys is not self._cached_keys:
            # The keys were refreshed: tokens of a withdrawn key must be verified again, and fail.
            self._valid, self._cached_keys = {}, self.keys.keys
        digest = hashlib.sha256(token.encode()).digest()
        ends, known = self._valid.pop(digest, (0.0, None))
        if known is None or time.time() >= ends:
            ends, known = self._verified(token)
            if len(self._valid) >= self.most:
                del self._valid[next(iter(self._valid))]
        self._valid[digest] = ends, known
        return known

    def _verified(self, token: str) -> tuple[float, Principal]:
        """Return the expiry time of a token, s since 1970, and its principal; raises Rejected."""
        try:
            claims = self._claims(token)
            ends = _numeric_date(claims["exp"]) + self.settings.jwt_leeway
            scopes = _scopes(claims.get(self.settings.jwt_scopes))
            return ends, principal.from_scopes(_pseudonym(claims), scopes)
        except _TOKEN_ERRORS as fault:
            raise InvalidCredentials(
                _REASONS.get(type(fault), "not a token that can be verified")
            ) from None

    def _claims(self, token: str) -> Mapping[str, Any]:
        key = self.keys.find(jwt.get_unverified_header(token).get("kid"))
        if key is None:
            raise InvalidCredentials("signed by a key that is not known")
        return jwt.decode(
            token,
            key,
            algorithms=[self.settings.jwt_algorithm],
            audience=self.settings.jwt_audience,
            issuer=self.settings.jwt_issuer,
            leeway=self.settings.jwt_leeway,
            options={"require": ["exp", "iss", "aud"]},
        )


def from_settings(settings: Settings) -> TokenVerifier:
    """Return the verifier of the settings, and start the thread that refreshes its keys.

    Raises FileError for an unusable source of keys.
    """
    keys = KeySet(settings.jwt_keys, settings.jwt_algorithm)
    threading.Thread(target=keys.watch, args=(settings.jwt_refresh,), daemon=True).start()
    return TokenVerifier(settings, keys)


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


def _numeric_date(claim: object) -> float:
    """Return a NumericDate (RFC 7519, 2), s.

    Raises ValueError for text, Booleans and large numbers, which PyJWT accepts.
    """
    if isinstance(claim, bool) or not isinstance(claim, int | float) or claim > LATEST_TIME:
        raise ValueError(f"exp is {type(claim).__name__}, expected a number up to {LATEST_TIME}")
    return float(claim)


def _pseudonym(claims: Mapping[str, Any]) -> str:
    """Return a name for the logs, a hash: the subject may be personal data."""
    subject = f"{claims['iss']}\n{claims.get('sub', '')}"
    return "token-" + hashlib.sha256(subject.encode()).hexdigest()[:12]


def _scopes(claim: object) -> list[str]:
    """Return the scopes of a claim: a string (RFC 8693) or a list of strings."""
    if isinstance(claim, str):
        return claim.split()
    return [word for word in claim if isinstance(word, str)] if isinstance(claim, list) else []
