"""Access policy of the service, made once from its settings."""

import ipaddress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from posefield.common.errors import FileError, InvalidField
from posefield.http.access import api_keys
from posefield.http.access.api_keys import ApiKeys
from posefield.http.api.settings import PREFIX, Settings

if TYPE_CHECKING:
    from posefield.http.access.bearer_tokens import TokenVerifier

ALGORITHMS = (
    *("RS256", "RS384", "RS512", "PS256", "PS384", "PS512"),
    *("ES256", "ES384", "ES512", "EdDSA"),
)
"""Accepted signature algorithms, all asymmetric: a shared secret could also issue tokens."""


@dataclass(frozen=True)
class AccessPolicy:
    """Accepted credentials; without any, every request is allowed.

    keys: API keys. tokens: verifier of bearer tokens, None without an issuer. metrics_open: the
    metrics need no credentials.
    """

    keys: ApiKeys
    tokens: "TokenVerifier | None"
    metrics_open: bool

    @property
    def requires_credentials(self) -> bool:
        """True if requests need credentials."""
        return bool(self.keys.known) or self.tokens is not None


def from_settings(settings: Settings) -> AccessPolicy:
    """Return the policy of the settings.

    Raises InvalidField and FileError for invalid keys or an unusable source of keys.
    """
    text = settings.keys
    if settings.keys_file:
        text = f"{_file_text(settings.keys_file)}\n{text}"
    known = api_keys.parse_keys(
        text, f"{PREFIX}KEYS" if not settings.keys_file else settings.keys_file
    )
    return AccessPolicy(known, _token_verifier(settings), settings.metrics_open)


def check_exposure(settings: Settings, policy: AccessPolicy) -> None:
    """Raise InvalidField if the service would listen beyond loopback without credentials.

    The setting `open` allows that.
    """
    if policy.requires_credentials or settings.open or _is_loopback(settings.host):
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


def _file_text(path: str) -> str:
    try:
        return Path(path).read_text("utf-8")
    except (OSError, UnicodeDecodeError) as fault:
        raise FileError(path, f"no file of keys: {fault}") from fault


def _token_verifier(settings: Settings) -> "TokenVerifier | None":
    """Return the verifier of tokens, None where the settings name no issuer."""
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
    # Imported here since its libraries are an optional dependency.
    from posefield.http.access import bearer_tokens

    return bearer_tokens.from_settings(settings)
