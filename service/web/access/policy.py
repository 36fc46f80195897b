"""Whom the service answers, made once from its settings."""

import importlib
import ipaddress
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from service.motion.errors import FileError, InvalidField
from service.web.access import keys
from service.web.access.keys import Keys
from service.web.access.principal import Principal
from service.web.settings import PREFIX, Settings

ALGORITHMS = (
    *("RS256", "RS384", "RS512", "PS256", "PS384", "PS512"),
    *("ES256", "ES384", "ES512", "EdDSA"),
)
"""Of public keys only: a shared secret would let whoever checks tokens make them, too."""


class Rejected(Exception):
    """Credentials that do not hold; the message says why and nothing of what they are."""


class Issuer(Protocol):
    """Tokens of somebody else: service.web.access.tokens.Tokens."""

    def find(self, token: str) -> Principal:
        """Who a token speaks for; raises Rejected."""


@dataclass(frozen=True)
class Policy:
    """Keys and tokens that let somebody in; without any of them everybody is."""

    keys: Keys
    tokens: Issuer | None
    metrics_open: bool

    @property
    def closed(self) -> bool:
        """Whether anybody has to say who they are."""
        return bool(self.keys.known) or self.tokens is not None


def of(settings: Settings) -> Policy:
    """Policy of the settings.

    Raises InvalidField and FileError for keys, or a source of keys, that cannot be used.
    """
    text = settings.keys
    if settings.keys_file:
        text = f"{_text(settings.keys_file)}\n{text}"
    known = keys.read(text, f"{PREFIX}KEYS" if not settings.keys_file else settings.keys_file)
    return Policy(known, _tokens(settings), settings.metrics_open)


def check_exposure(settings: Settings, policy: Policy) -> None:
    """Raise InvalidField where others could ask without having to say who they are."""
    if policy.closed or settings.open or _is_loopback(settings.host):
        return
    raise InvalidField(
        f"{PREFIX}HOST",
        f"{settings.host!r} lets everybody ask who reaches it; expected {PREFIX}KEYS_FILE, "
        f"{PREFIX}KEYS or {PREFIX}JWT_KEYS, or {PREFIX}OPEN=1 to say that this is wanted",
    )


def _is_loopback(host: str) -> bool:
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _text(path: str) -> str:
    try:
        return Path(path).read_text("utf-8")
    except (OSError, UnicodeDecodeError) as fault:
        raise FileError(path, f"no file of keys: {fault}") from fault


def _tokens(settings: Settings) -> Issuer | None:
    """Checker of tokens; its libraries are an extra, imported where they are wanted."""
    given = {
        "JWT_KEYS": settings.jwt_keys,
        "JWT_ISSUER": settings.jwt_issuer,
        "JWT_AUDIENCE": settings.jwt_audience,
    }
    if not any(given.values()):
        return None
    for name, value in given.items():
        if not value:
            raise InvalidField(PREFIX + name, f"missing; tokens need all of {', '.join(given)}")
    if settings.jwt_algorithm not in ALGORITHMS:
        raise InvalidField(
            f"{PREFIX}JWT_ALGORITHM",
            f"{settings.jwt_algorithm!r}, expected one of {', '.join(ALGORITHMS)}",
        )
    issuer: Issuer = importlib.import_module("service.web.access.tokens").of(settings)
    return issuer
