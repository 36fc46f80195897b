"""Bearer tokens (JWT, RFC 7519) of an issuer that the operator trusts.

What is checked is pinned by settings: one algorithm, one issuer, one audience. Nothing that a token
says of itself is followed but the id of its key, and that only among the keys that are here.
"""

import hashlib
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import jwt

from service.web.access import principal
from service.web.access.keyset import KeySet
from service.web.access.policy import Rejected
from service.web.access.principal import Principal
from service.web.settings import Settings

CACHED = 10_000
"""Tokens that are remembered, in 2 MB. Only valid ones are: nobody fills it with rubbish."""


@dataclass(frozen=True)
class Terms:
    """What a token has to say. leeway: seconds that clocks may differ; scopes: a claim's name."""

    issuer: str
    audience: str
    algorithm: str
    leeway: int
    scopes: str


@dataclass
class Tokens:
    """Tokens of one issuer; those found good are remembered until they end."""

    terms: Terms
    keys: KeySet
    _good: dict[bytes, tuple[float, Principal]] = field(default_factory=dict)
    _under: Mapping[str | None, jwt.PyJWK] | None = None

    def find(self, token: str) -> Principal:
        """Who a token speaks for; raises Rejected."""
        if self.keys.keys is not self._under:
            # A key that has gone takes its tokens with it.
            self._good, self._under = {}, self.keys.keys
        digest = hashlib.sha256(token.encode()).digest()
        ends, known = self._good.get(digest, (0.0, None))
        if known is not None and time.time() < ends:
            return known
        self._good.pop(digest, None)
        return self._remember(digest, self._verified(token))

    def _verified(self, token: str) -> Mapping[str, Any]:
        terms = self.terms
        try:
            kid = jwt.get_unverified_header(token).get("kid")
            key = self.keys.find(kid)
            if key is None:
                raise Rejected("signed by a key that is not known")
            claims: Mapping[str, Any] = jwt.decode(
                token,
                key,
                algorithms=[terms.algorithm],
                audience=terms.audience,
                issuer=terms.issuer,
                leeway=terms.leeway,
                options={"require": ["exp", "iss", "aud"]},
            )
        except _FAULTS as fault:
            raise Rejected(_WORDS.get(type(fault), "not a token that can be verified")) from None
        return claims

    def _remember(self, digest: bytes, claims: Mapping[str, Any]) -> Principal:
        known = principal.of(_pseudonym(claims), _scopes(claims.get(self.terms.scopes)))
        if len(self._good) >= CACHED:
            del self._good[next(iter(self._good))]
        self._good[digest] = (float(claims["exp"]) + self.terms.leeway, known)
        return known


def of(settings: Settings) -> Tokens:
    """Tokens of the settings, whose keys are read now and watched from now on.

    Raises FileError for keys that cannot be read.
    """
    found = KeySet(settings.jwt_keys, settings.jwt_algorithm, settings.jwt_refresh)
    found.start()
    terms = Terms(
        settings.jwt_issuer,
        settings.jwt_audience,
        settings.jwt_algorithm,
        settings.jwt_leeway,
        settings.jwt_scopes,
    )
    return Tokens(terms, found)


# The last four: JSON that nests deeply, and claims of another type than they should have.
_FAULTS = (jwt.PyJWTError, RecursionError, OverflowError, TypeError, ValueError)

_WORDS: dict[type[Exception], str] = {
    jwt.ExpiredSignatureError: "expired",
    jwt.ImmatureSignatureError: "not valid yet",
    jwt.InvalidAudienceError: "meant for another audience",
    jwt.InvalidIssuerError: "of another issuer",
    jwt.InvalidSignatureError: "its signature is wrong",
    jwt.InvalidAlgorithmError: "signed by another algorithm",
    jwt.MissingRequiredClaimError: "without one of exp, iss, aud",
}


def _pseudonym(claims: Mapping[str, Any]) -> str:
    """Name for the log: subjects may be addresses of people."""
    subject = f"{claims['iss']}\n{claims.get('sub', '')}"
    return "token-" + hashlib.sha256(subject.encode()).hexdigest()[:12]


def _scopes(claim: object) -> list[str]:
    """Words of a claim, which is a text (RFC 8693) or a list of texts."""
    if isinstance(claim, str):
        return claim.split()
    return [word for word in claim if isinstance(word, str)] if isinstance(claim, list) else []
