"""Headers: limits on those of requests; caching, CORS and security in those of responses.

A page of another origin can make a browser send requests to a local service under the page's host
name (DNS rebinding). The browser then sends that name as Host, not an address or a listed name.

The response to a GET depends only on the model file, the request line, the code and the rounding of
this machine. Their digest is its strong entity tag; computing it takes two microseconds.

CORS (Fetch standard) allows no other origin by default. Browser credentials (cookies) are never
allowed: clients authenticate by a header that the page sets, so a page cannot act with its
visitor's identity.

`X-Frame-Options` is omitted since `frame-ancestors` replaces it. Only pages need `Referrer-Policy`,
since data has no links. The proxy that terminates TLS sets `Strict-Transport-Security`.
"""

import ipaddress
import platform
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from hashlib import blake2b
from importlib.metadata import version
from pathlib import Path

from starlette.types import Scope

import posefield
from posefield.common.errors import InvalidField
from posefield.http.api.problems import HEAD_TOO_LARGE, UNKNOWN_HOST, URL_TOO_LONG, RequestError

LOOPBACK = ("localhost",)
"""Default of the accepted host names; IP addresses are always accepted."""
MAX_FIELDS = 100
"""Maximum number of header lines of a request; browsers send 20."""


@dataclass(frozen=True)
class HeadLimits:
    """Limits on request heads.

    url: maximum bytes of the path and query. headers: maximum bytes of all headers. names: accepted
    host names in lower case; a name with a leading dot matches as a suffix, "*" matches all.
    """

    url: int
    headers: int
    names: tuple[str, ...]
    _known: set[bytes] = field(default_factory=set)

    def check(self, scope: Scope) -> None:
        """Raise RequestError for a long URL (414), large headers (431) or an unknown host (421)."""
        # raw_path is optional in ASGI.
        path = scope.get("raw_path") or scope["path"].encode()
        if len(path) + len(scope["query_string"]) > self.url:
            raise RequestError(URL_TOO_LONG, f"expected at most {self.url} bytes")
        size, hosts, count = 0, [], 0
        for name, value in scope["headers"]:
            size += len(name) + len(value)
            count += 1
            if name == b"host":
                hosts.append(value)
        if size > self.headers or count > MAX_FIELDS:
            detail = f"expected at most {self.headers} bytes in at most {MAX_FIELDS} headers"
            raise RequestError(HEAD_TOO_LARGE, detail)
        # HTTP/1.0 has no Host; load balancers still use it for health checks.
        if len(hosts) > 1 or (not hosts and scope["http_version"] != "1.0"):
            raise RequestError(UNKNOWN_HOST, f"{len(hosts)} Host headers, expected one")
        if hosts and hosts[0] not in self._known:
            self._check_host(hosts[0])

    def _check_host(self, given: bytes) -> None:
        name = _without_port(given.decode("latin-1").lower())
        if not (_is_address(name) or any(_matches(name, known) for known in self.names)):
            shown = (f"*{known}" if known.startswith(".") else known for known in self.names)
            expected = ", ".join(shown)
            detail = f"{name[:100]!r}, expected an address or one of {expected} (POSEFIELD_HOSTS)"
            raise RequestError(UNKNOWN_HOST, detail)
        # Bounded: clients can make up any number of accepted Host values.
        if len(self._known) < 100:
            self._known.add(given)


def host_names(text: str, setting: str) -> tuple[str, ...]:
    """Return host names of a text with commas between, LOOPBACK for an empty one.

    `*.example.com` stands for all names below `example.com`, `*` for all names. Raises
    InvalidField, which names the setting, for a name with a port or a scheme.
    """
    found = [part.strip().lower() for part in text.split(",") if part.strip()]
    for name in found:
        if name != "*" and not _NAME.issuperset(name.removeprefix("*.")):
            raise InvalidField(setting, f"{name!r}, expected names as example.com, *.example.com")
    return tuple(name.removeprefix("*") if name != "*" else name for name in found) or LOOPBACK


_NAME = frozenset("abcdefghijklmnopqrstuvwxyz0123456789.-_")


def _matches(name: str, known: str) -> bool:
    return known in ("*", name) or (known.startswith(".") and name.endswith(known))


def _without_port(given: str) -> str:
    if given.startswith("["):
        return given[1:].partition("]")[0]
    return given.partition(":")[0].removesuffix(".")


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


NO_STORE = b"no-store"
IMMUTABLE = b"max-age=31536000, immutable"
NO_CACHE = b"no-cache"
PUBLIC = b"public, "

LIBRARIES = ("backports.zstd", "msgspec", "nanoarrow", "numpy", "onnxruntime", "orjson", "usd-core")
"""Libraries whose versions can affect the bytes of a response."""


class NotModified(Exception):
    """The client's cached response is current (304)."""


def code_digest() -> bytes:
    """Return a digest of the sources, the library versions and the machine type.

    Responses depend on these, on the model and on the request.
    """
    digest = blake2b(digest_size=16)
    root = Path(posefield.__file__).parent
    for source in sorted(
        [each for kind in ("py", "yaml", "npz") for each in root.rglob(f"*.{kind}")]
    ):
        digest.update(source.relative_to(root).as_posix().encode() + b"\0")
        digest.update(source.read_bytes())
    for name in LIBRARIES:
        digest.update(f"{name} {version(name)}\0".encode())
    digest.update(platform.machine().encode())
    return digest.digest()


def entity_tag(*parts: bytes, coding: str | None = None) -> str:
    """Return the strong entity tag of a response that depends only on `parts`.

    coding: content coding of the response, if any.
    """
    digest = blake2b(b"\0".join(parts), digest_size=16).hexdigest()
    return f'"{digest}-{coding}"' if coding else f'"{digest}"'


def matches_tag(given: str, own: str) -> bool:
    """Return True if an If-None-Match header matches an entity tag.

    The comparison is weak (RFC 9110, 13.1.2). given: the header. own: the tag.
    """
    if given == own:
        return True
    return given.strip() == "*" or own in (t.strip().removeprefix("W/") for t in given.split(","))


def cache_control(model: str, alias_seconds: int, closed: bool) -> bytes:
    """Return the Cache-Control of a response of a model.

    model: key in the path; with a hash the response is immutable, with the name alone it stays
    fresh for `alias_seconds`, and must be revalidated for 0. closed: the service needs credentials,
    so only private caches may store the response.
    """
    whose = b"private, " if closed else PUBLIC
    if "@" in model:
        return whose + IMMUTABLE
    return whose + (b"max-age=%d" % alias_seconds if alias_seconds else NO_CACHE)


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


DATA_HEADERS = (
    (b"x-content-type-options", b"nosniff"),
    (b"content-security-policy", b"default-src 'none'; frame-ancestors 'none'"),
    # Concerns embedding without CORS; it does not block requests that CORS allows.
    (b"cross-origin-resource-policy", b"same-origin"),
)
"""Headers of data responses."""

PAGE_HEADERS = tuple(pair for pair in DATA_HEADERS if pair[0] != b"content-security-policy")
"""Headers of HTML pages; `page_headers` returns their own Content-Security-Policy."""


def security_headers(media_type: str | None, status: int = 200) -> tuple[tuple[bytes, bytes], ...]:
    """Return the security headers of a response.

    A 304 has no Content-Security-Policy: it would replace that of the browser's cached page, which
    could then load nothing.
    """
    return PAGE_HEADERS if media_type == "text/html" or status == 304 else DATA_HEADERS


def page_headers(script: str, style: str) -> dict[str, str]:
    """Return the headers of an HTML page that loads nothing from other origins.

    script, style: sources of a Content-Security-Policy.
    """
    sources = f"default-src 'none'; script-src {script}; style-src {style}; connect-src 'self'"
    # Workers come from the page itself, which reads motion files in them.
    workers = "worker-src blob:"
    more = "img-src 'self' data:; font-src 'self'; base-uri 'none'; form-action 'none'"
    return {
        "Content-Security-Policy": f"{sources}; {workers}; {more}; frame-ancestors 'none'",
        "Referrer-Policy": "no-referrer",
    }
