"""Content codings: negotiation by Accept-Encoding, and compression of responses."""

import gzip
import re
import zlib
from collections.abc import AsyncIterator, Callable
from functools import lru_cache, partial
from typing import Any

from backports import zstd
from starlette.datastructures import MutableHeaders
from starlette.responses import Response, StreamingResponse

from posefield.http.concurrency import worker_threads

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
    found = max(CODINGS, key=lambda coding: weights.get(coding, anything))
    weight = weights.get(found, anything)
    return found if weight > 0.0 and weight >= weights.get("identity", 0.0) else None


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
    response.body = (
        compress(content) if quick else await worker_threads.run_in_thread(compress, content)
    )
    headers: MutableHeaders = response.headers
    headers["Content-Encoding"] = coding
    headers["Content-Length"] = str(len(response.body))


def _zstd(content: bytes) -> bytes:
    return zstd.compress(content, ZSTD_LEVEL)


def _gzip(content: bytes) -> bytes:
    # mtime=0: equal content gives equal bytes.
    return gzip.compress(content, GZIP_LEVEL, mtime=0)


_COMPRESS: dict[str, Callable[[bytes], bytes]] = {"zstd": _zstd, "gzip": _gzip}


async def _compress_stream(pieces: AsyncIterator[bytes], coding: str) -> AsyncIterator[bytes]:
    """Yield the compressed pieces as one stream.

    Browsers decode only the first frame or member of a body.
    """
    stream = _STREAMS[coding]()
    async for piece in pieces:
        if packed := await worker_threads.run_in_thread(stream.compress, piece):
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
    return [_parse_weight(part) for part in header.split(",") if part.strip()]


def _parse_weight(part: str) -> tuple[str, float]:
    name, *parameters = (piece.strip() for piece in part.split(";"))
    weights = [found for found in map(_WEIGHT.fullmatch, parameters) if found]
    return name.lower(), float(weights[0][1]) if weights else 1.0
