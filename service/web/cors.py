"""Which pages of other origins may read answers (CORS, the Fetch standard): none, if not told.

Credentials of a browser (cookies) are never allowed: who may ask is said by a header that the page
sets itself, so that no page can ask in the name of whoever looks at it.
"""

import re
from collections.abc import Mapping

from service.motion.errors import InvalidField

Headers = list[tuple[bytes, bytes]]

EVERY = frozenset({b"*"})

# Scheme, host in lower case, and the port where it is not the scheme's own: as browsers write it.
_ORIGIN = re.compile(r"https?://([a-z0-9.-]+|\[[0-9a-f:]+\])(:[0-9]{1,5})?")

_READABLE = b", ".join(
    (
        *(b"Allow", b"Content-Disposition", b"ETag", b"Retry-After", b"WWW-Authenticate"),
        # Without it a page would take the length of compressed content for that of what it reads.
        b"Content-Encoding",
        *(b"Posefield-Duration", b"Posefield-Inferred", b"Posefield-Missed", b"Posefield-Model"),
        *(b"Posefield-Sigma", b"Posefield-Supported", b"Posefield-Warning"),
        *(b"X-Request-Id", b"Inference-Header-Content-Length"),
    )
)
_TAKEN = b", ".join(
    (
        *(b"Authorization", b"Content-Type", b"If-None-Match", b"Inference-Header-Content-Length"),
        *(b"Prefer", b"Traceparent", b"Tracestate", b"X-Request-Id"),
    )
)
_REMEMBERED = b"7200"
"""Seconds that a browser need not ask again; more than two hours no browser takes."""


def read(text: str, field: str) -> frozenset[bytes]:
    """Origins of a text with commas between, or `*` for all; InvalidField where one is none."""
    origins = frozenset(filter(None, (part.strip() for part in text.split(","))))
    if origins == {"*"}:
        return EVERY
    for origin in sorted(origins):
        if not _ORIGIN.fullmatch(origin):
            raise InvalidField(field, f"{origin!r}, expected https://host or https://host:port")
    return frozenset(origin.encode() for origin in origins)


def headers(origin: bytes | None, allowed: frozenset[bytes]) -> Headers:
    """What every answer says to a page's browser; origin: the request's, where it has one."""
    if not allowed:
        return []
    if allowed == EVERY:
        return [(b"access-control-allow-origin", b"*"), *_SHOWN]
    # A cache has to keep the answers to different pages apart, and to no page at all.
    varying = (b"vary", b"Origin")
    if origin not in allowed:
        return [varying]
    return [varying, (b"access-control-allow-origin", origin), *_SHOWN]


_SHOWN = [(b"access-control-expose-headers", _READABLE)]


def preflight(allow: bytes) -> Headers:
    """What the answer to OPTIONS says beside `headers`; allow: the methods of the path."""
    return [
        (b"access-control-allow-methods", allow),
        (b"access-control-allow-headers", _TAKEN),
        (b"access-control-max-age", _REMEMBERED),
    ]


def is_preflight(given: Mapping[bytes, bytes]) -> bool:
    """Whether a browser asks with OPTIONS if it may ask otherwise; given: the request's headers."""
    return b"origin" in given and b"access-control-request-method" in given
