"""Content negotiation by Accept (RFC 9110, 12.5.1) and Accept-Encoding, and compression.

Accept applies to paths without a format. Invalid members of the header are skipped, since old
clients send members like `*; q=.2`.
"""

import gzip
import re
import zlib
from collections.abc import AsyncIterator, Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any

from backports import zstd
from starlette.datastructures import MutableHeaders
from starlette.requests import Request
from starlette.responses import Response, StreamingResponse

from posefield.http import batching
from posefield.http.api.problems import NOT_ACCEPTABLE, RequestError

VARY = "Accept"
MAX_ACCEPT_LENGTH = 1000
Offers = tuple[tuple[str, str], ...]
"""Names and media types of formats, the default first."""

_TOKEN = r"[!#$%&'*+.^_`|~0-9A-Za-z-]++"
_QUOTED = r'"(?:[^"\\]|\\.)*+"'
_MEMBER = re.compile(rf"(?:{_QUOTED}|[^,\"])++")
_RANGE = re.compile(
    rf"\s*+({_TOKEN})/({_TOKEN})((?:\s*+;\s*+(?:{_TOKEN}=(?:{_TOKEN}|{_QUOTED}))?+)*+)\s*+"
)
_PARAMETER = re.compile(rf"({_TOKEN})=({_TOKEN}|{_QUOTED})")
_RANGE_WEIGHT = re.compile(r"[01]|[01]?\.[0-9]*+", re.ASCII)
UTF8 = ("charset", "utf-8")
"""The parameter that is ignored: all text responses are in UTF-8."""


@dataclass(frozen=True)
class _MediaRange:
    """A media range of Accept, with its weight from 0 to 1; `*` matches any kind or subtype."""

    kind: str
    subtype: str
    weight: float

    def precedence(self, media_type: str) -> int:
        """Return how specifically the range matches a media type.

        2 for type and subtype, 1 for the type only, 0 for any type, -1 for no match.
        """
        kind, _, subtype = media_type.partition("/")
        if (self.kind, self.subtype) == (kind, subtype):
            return 2
        if (self.kind, self.subtype) == (kind, "*"):
            return 1
        return 0 if (self.kind, self.subtype) == ("*", "*") else -1


def negotiated_format(request: Request, offers: Offers) -> str:
    """Return the format that a request prefers; raises RequestError 406 if it accepts none."""
    lines = [value.decode("latin-1") for name, value in request["headers"] if name == b"accept"]
    if not lines:
        return offers[0][0]
    accept = ", ".join(lines)
    # Long headers are not cached: 256 of them would take megabytes.
    find = preferred_format if len(accept) <= MAX_ACCEPT_LENGTH else preferred_format.__wrapped__
    preferred = find(accept, offers)
    if preferred is None:
        there = ", ".join(media_type for _, media_type in offers)
        detail = f"Accept {accept[:200]!r}, expected one of {there}"
        raise RequestError(NOT_ACCEPTABLE, detail, headers={"Vary": VARY})
    return preferred


# Most clients send one of few headers; the cache evicts the others.
@lru_cache(maxsize=256)
def preferred_format(accept: str, offers: Offers) -> str | None:
    """Return the format of the greatest weight; None if no format is accepted.

    Among equal weights the most specific match wins, then the first offer. An empty header accepts
    everything.
    """
    if not accept.strip():
        return offers[0][0]
    ranges = list(_media_ranges(accept))
    best, preferred = (0.0, -1), None
    for name, media_type in offers:
        match = max(((r.precedence(media_type), r.weight) for r in ranges), default=(-1, 0.0))
        if match[0] >= 0 and match[1] > 0.0 and match[::-1] > best:
            best, preferred = match[::-1], name
    return preferred


def _media_ranges(accept: str) -> Iterator[_MediaRange]:
    """Yield the valid media ranges; skip those with parameters that no offer has."""
    for member in _MEMBER.finditer(accept):
        media_range = _RANGE.fullmatch(member[0])
        weight = _range_weight(media_range[3]) if media_range else None
        if media_range and weight is not None:
            yield _MediaRange(media_range[1].lower(), media_range[2].lower(), weight)


def _range_weight(parameters: str) -> float | None:
    """Return the weight of a member; None if it or a media type parameter excludes all offers."""
    for name, value in _PARAMETER.findall(parameters):
        if name.lower() == "q":
            return (
                min(float(value), 1.0) if _RANGE_WEIGHT.fullmatch(value) and value != "." else None
            )
        if (name.lower(), value.strip('"').lower()) != UTF8:
            return None
    return 1.0


CODINGS = ("zstd", "gzip")
"""Supported codings, the preferred first: zstd takes a tenth of gzip's time at the same size."""

COMPRESSIBLE_TYPES = frozenset(
    {
        "application/json",
        "application/problem+json",
        "application/x-bvh",
        "application/yaml",
        "model/vnd.usda",
        "text/html",
        "text/javascript",
        "text/css",
    }
)
"""Compressed media types, all text: binary numbers shrink by a twelfth at most, zip files not."""

MIN_SIZE = 1000
"""Minimum bytes of a compressed response: smaller ones fit in one packet."""

MAX_INLINE_SIZE = 1 << 18
"""Maximum bytes that are compressed in the event loop rather than in a thread."""

ZSTD_LEVEL, GZIP_LEVEL = 3, 6


@lru_cache(256)
def preferred_coding(accepted: bytes) -> str | None:
    """Return the coding that an Accept-Encoding header prefers; None for no coding."""
    weights = dict(reversed(parse_weights(accepted.decode("latin-1"))))
    anything = weights.get("*", 0.0)
    preferred = max(CODINGS, key=lambda coding: weights.get(coding, anything))
    weight = weights.get(preferred, anything)
    return preferred if weight > 0.0 and weight >= weights.get("identity", 0.0) else None


def is_compressible(media_type: str | None) -> bool:
    """Return True if responses of a media type are compressed."""
    return (media_type or "").partition(";")[0] in COMPRESSIBLE_TYPES


async def compress_response(response: Response, coding: str) -> None:
    """Compress a response in place, if its type and size are worth it and it is not yet encoded."""
    if (
        not is_compressible(response.headers.get("content-type"))
        or "content-encoding" in response.headers
    ):
        return
    if isinstance(response, StreamingResponse):
        response.body_iterator = _compress_stream(response.body_iterator, coding)  # type: ignore[arg-type]
        response.headers["Content-Encoding"] = coding
    elif len(response.body) >= MIN_SIZE:
        await _compress_body(response, coding)


async def _compress_body(response: Response, coding: str) -> None:
    content = bytes(response.body)
    quick = len(content) <= MAX_INLINE_SIZE
    compress = _COMPRESS[coding]
    response.body = compress(content) if quick else await batching.run_in_thread(compress, content)
    headers: MutableHeaders = response.headers
    headers["Content-Encoding"] = coding
    headers["Content-Length"] = str(len(response.body))


_COMPRESS: dict[str, Callable[[bytes], bytes]] = {
    "zstd": lambda content: zstd.compress(content, ZSTD_LEVEL),
    # mtime=0: equal content gives equal bytes.
    "gzip": lambda content: gzip.compress(content, GZIP_LEVEL, mtime=0),
}


async def _compress_stream(pieces: AsyncIterator[bytes], coding: str) -> AsyncIterator[bytes]:
    """Yield the compressed pieces as one stream.

    Browsers decode only the first frame or member of a body.
    """
    stream = _STREAMS[coding]()
    async for piece in pieces:
        if packed := await batching.run_in_thread(stream.compress, piece):
            yield packed
    yield stream.flush()


_STREAMS: dict[str, Callable[[], Any]] = {
    "zstd": partial(zstd.ZstdCompressor, ZSTD_LEVEL),
    "gzip": partial(zlib.compressobj, GZIP_LEVEL, zlib.DEFLATED, 16 + zlib.MAX_WBITS),
}
"""Compressor factories; `16 +` selects the gzip format in zlib."""


_WEIGHT = re.compile(r"q=(0(?:\.[0-9]{0,3})?|1(?:\.0{0,3})?)", re.IGNORECASE)


def parse_weights(header: str) -> list[tuple[str, float]]:
    """Return the names, in lower case, and their weights; 1 for a missing or invalid weight."""
    pairs = []
    for member in filter(str.strip, header.split(",")):
        name, *parameters = map(str.strip, member.split(";"))
        matches = filter(None, map(_WEIGHT.fullmatch, parameters))
        weight = next(matches, None)
        pairs.append((name.lower(), float(weight[1]) if weight else 1.0))
    return pairs
