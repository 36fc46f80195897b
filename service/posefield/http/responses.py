"""Responses of operations, and the headers of all: caching, CORS and security.

The response to a GET depends only on the model file, the request line, the code and the rounding of
this machine. Their digest is its strong entity tag; computing it takes two microseconds.

CORS (Fetch standard) allows no other origin by default. Browser credentials (cookies) are never
allowed: clients authenticate by a header that the page sets, so a page cannot act with its
visitor's identity.

`X-Frame-Options` is omitted since `frame-ancestors` replaces it. Only pages need `Referrer-Policy`,
since data has no links. The proxy that terminates TLS sets `Strict-Transport-Security`.
"""

import json
import platform
import re
from collections.abc import AsyncIterator, Iterable, Iterator, Sequence
from hashlib import blake2b
from importlib.metadata import version
from pathlib import Path
from typing import Any

import orjson
from anyio import CapacityLimiter
from starlette.responses import Response, StreamingResponse

import posefield
from posefield.common.errors import InvalidField
from posefield.encode.archives import Format
from posefield.http import batching
from posefield.question.performance_report import PerformanceReport
from posefield.question.results import Trust

NO_STORE = b"no-store"
IMMUTABLE = b"max-age=31536000, immutable"
NO_CACHE = b"no-cache"
PUBLIC = b"public, "

LIBRARIES = ("backports.zstd", "msgspec", "nanoarrow", "numpy", "onnxruntime", "orjson", "usd-core")
"""Libraries whose versions can affect the bytes of a response."""


def code_digest() -> bytes:
    """Return a digest of the sources, the library versions and the machine type.

    Responses depend on these, on the model and on the request.
    """
    digest = blake2b(digest_size=16)
    root = Path(posefield.__file__).parent
    for source in sorted(
        [path for kind in ("py", "yaml", "npz") for path in root.rglob(f"*.{kind}")]
    ):
        digest.update(source.relative_to(root).as_posix().encode() + b"\0")
        digest.update(source.read_bytes())
    for name in LIBRARIES:
        digest.update(f"{name} {version(name)}\0".encode())
    digest.update(platform.machine().encode())
    return digest.digest()


def entity_tag(*inputs: bytes, coding: str | None = None) -> str:
    """Return the strong entity tag of a response that depends only on `inputs`.

    coding: content coding of the response, if any.
    """
    digest = blake2b(b"\0".join(inputs), digest_size=16).hexdigest()
    return f'"{digest}-{coding}"' if coding else f'"{digest}"'


def matches_tag(header: str, tag: str) -> bool:
    """Return True if an If-None-Match header matches an entity tag.

    The comparison is weak (RFC 9110, 13.1.2). header: that of the request.
    """
    if header == tag:
        return True
    return header.strip() == "*" or tag in (t.strip().removeprefix("W/") for t in header.split(","))


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
    origins = frozenset(filter(None, (item.strip() for item in text.split(","))))
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


DATA_HEADERS = (
    (b"x-content-type-options", b"nosniff"),
    (b"content-security-policy", b"default-src 'none'; frame-ancestors 'none'"),
    # Concerns embedding without CORS; it does not block requests that CORS allows.
    (b"cross-origin-resource-policy", b"same-origin"),
)
"""Headers of data responses."""

PAGE_HEADERS = tuple(pair for pair in DATA_HEADERS if pair[0] != b"content-security-policy")
"""Headers of HTML pages; `page_headers` returns their own Content-Security-Policy."""


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


def json_document(content: Any) -> Response:
    """Return a JSON response of plain values."""
    return Response(orjson.dumps(content), media_type="application/json")


def attachment(content: bytes, form: Format, model: str) -> Response:
    """Return a response with a file to download, named after the model."""
    return Response(content, headers=_disposition(form, model), media_type=form.media_type)


def stream(
    pieces: Iterable[bytes],
    form: Format,
    name: str,
    warnings: Sequence[str],
    limiter: CapacityLimiter,
    model: str | None = None,
) -> Response:
    """Return a response that streams a file to download, made in threads within a limit.

    name: of the file, without extension. warnings: sent as headers. model: identity, in a header.
    """
    headers = _disposition(form, name)
    if model is not None:
        headers["Posefield-Model"] = model
    sent = _sent(merged_chunks(pieces), limiter)
    response = StreamingResponse(sent, headers=headers, media_type=form.media_type)
    return _add_warnings(response, warnings)


def _disposition(form: Format, model: str) -> dict[str, str]:
    return {"Content-Disposition": f'attachment; filename="{model}.{form.extension}"'}


def clip_file(content: bytes, form: Format, trust: Trust) -> Response:
    """Return a response with a clip to download; headers hold its trust for all formats."""
    headers = {
        **_disposition(form, trust.model.partition("@")[0]),
        "Posefield-Model": trust.model,
        "Posefield-Sigma": repr(trust.sigma),
        "Posefield-Duration": repr(trust.duration),
        "Posefield-Supported": "true" if trust.supported else "false",
    }
    if trust.inferred:
        chosen = {name: trust.controls[name] for name in trust.inferred}
        headers["Posefield-Inferred"] = json.dumps(chosen)
    response = Response(content, headers=headers, media_type=form.media_type)
    for result in trust.targets:
        if not result.reached:
            target = {"what": result.what, "miss": result.miss, "unit": result.unit}
            response.headers.append("Posefield-Missed", json.dumps(target))
    return _add_warnings(response, trust.warnings)


def performance_file(content: bytes, form: Format, report: PerformanceReport) -> Response:
    """Return a response with a performance, or its plan; headers hold facts of its report."""
    headers = {
        **_disposition(form, "performance"),
        "Posefield-Model": report.model,
        "Posefield-Sigma": repr(report.sigma),
        "Posefield-Duration": repr(report.duration),
        "Posefield-Supported": "true" if report.supported else "false",
    }
    response = Response(content, headers=headers, media_type=form.media_type)
    return _add_warnings(response, report.warnings)


def _add_warnings(response: Response, warnings: Sequence[str]) -> Response:
    for warning in warnings:
        # A JSON string is ASCII, and its quotes protect commas, which separate joined headers.
        response.headers.append("Posefield-Warning", json.dumps(warning))
    return response


MIN_CHUNK_SIZE = 1 << 18
"""Minimum bytes of a piece, since a thread switch per piece takes a tenth of a millisecond."""


def merged_chunks(pieces: Iterable[bytes]) -> Iterator[bytes]:
    """Yield the bytes in pieces of at least MIN_CHUNK_SIZE, except the last; none is empty."""
    buffered, size = [], 0
    for piece in pieces:
        buffered.append(piece)
        size += len(piece)
        if size >= MIN_CHUNK_SIZE:
            yield b"".join(buffered)
            buffered, size = [], 0
    if size:
        yield b"".join(buffered)


async def _sent(pieces: Iterator[bytes], limiter: CapacityLimiter) -> AsyncIterator[bytes]:
    """Yield the pieces, each generated in a thread after the previous one was sent.

    pieces: none may be empty. When the client disconnects, generation stops after the current
    piece.
    """
    while piece := await batching.run_in_thread(next, pieces, b"", limiter=limiter):
        yield piece
