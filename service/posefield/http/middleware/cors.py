"""CORS (Fetch standard): headers that allow pages of other origins to read responses.

The default allows no other origin. Browser credentials (cookies) are never allowed: clients
authenticate by a header that the page sets, so a page cannot act with its visitor's identity.
"""

import re
from collections.abc import Mapping

from posefield.common.errors import InvalidField

Headers = list[tuple[bytes, bytes]]

ANY_ORIGIN = frozenset({b"*"})

# As browsers serialise it: scheme, host in lower case, and the port unless it is the default.
_ORIGIN = re.compile(r"https?://([a-z0-9.-]+|\[[0-9a-f:]+\])(:[0-9]{1,5})?")

_EXPOSED_HEADERS = b", ".join(
    (
        *(b"Allow", b"Content-Disposition", b"ETag", b"Retry-After", b"WWW-Authenticate"),
        # Tells a page that Content-Length is that of compressed content.
        b"Content-Encoding",
        *(b"Posefield-Duration", b"Posefield-Inferred", b"Posefield-Missed", b"Posefield-Model"),
        *(b"Posefield-Sigma", b"Posefield-Supported", b"Posefield-Warning"),
        b"X-Request-Id",
    )
)
_ALLOWED_HEADERS = b", ".join(
    (
        *(b"Authorization", b"Content-Type", b"If-None-Match", b"Prefer"),
        *(b"Traceparent", b"Tracestate", b"X-Request-Id"),
    )
)
_MAX_AGE = b"7200"
"""Lifetime of a preflight response, s; browsers accept at most two hours."""


def parse_origins(text: str, field: str) -> frozenset[bytes]:
    """Return the origins of a comma-separated text, `*` for all.

    field: name of the setting. Raises InvalidField for an invalid origin.
    """
    origins = frozenset(filter(None, (part.strip() for part in text.split(","))))
    if origins == {"*"}:
        return ANY_ORIGIN
    for origin in sorted(origins):
        if not _ORIGIN.fullmatch(origin):
            raise InvalidField(field, f"{origin!r}, expected https://host or https://host:port")
    return frozenset(origin.encode() for origin in origins)


def cors_headers(origin: bytes | None, allowed: frozenset[bytes]) -> Headers:
    """Return the CORS headers of a response.

    origin: header Origin of the request, if any. allowed: origins of the settings.
    """
    if not allowed:
        return []
    if allowed == ANY_ORIGIN:
        return [(b"access-control-allow-origin", b"*"), *_EXPOSE]
    # Caches must separate responses by origin, also those without one.
    varying = (b"vary", b"Origin")
    if origin not in allowed:
        return [varying]
    return [varying, (b"access-control-allow-origin", origin), *_EXPOSE]


_EXPOSE = [(b"access-control-expose-headers", _EXPOSED_HEADERS)]


def preflight_headers(allow: bytes) -> Headers:
    """Return the headers of a preflight response, beside `cors_headers`.

    allow: methods of the path.
    """
    return [
        (b"access-control-allow-methods", allow),
        (b"access-control-allow-headers", _ALLOWED_HEADERS),
        (b"access-control-max-age", _MAX_AGE),
    ]


def is_preflight(given: Mapping[bytes, bytes]) -> bool:
    """Return True if an OPTIONS request with these headers is a CORS preflight."""
    return b"origin" in given and b"access-control-request-method" in given
