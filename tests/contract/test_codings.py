"""Tests of content codings: zstd or gzip by Accept-Encoding, with equal decoded bytes."""

import asyncio
import gzip
import zlib
from urllib.parse import urlencode

import pytest
from backports import zstd

from posefield.http import negotiation

UNPACK = {"zstd": zstd.decompress, "gzip": gzip.decompress}


def raw(ask, url, accepted):
    """Status, headers and body as they travel: httpx would undo the coding."""
    return ask("GET", url, headers={"accept-encoding": accepted})


@pytest.mark.parametrize(
    ("accepted", "coding"),
    [
        ("gzip, zstd", "zstd"),
        ("gzip, deflate, br, zstd", "zstd"),
        ("gzip;q=1, zstd;q=0.5", "gzip"),
        ("*", "zstd"),
        ("*, zstd;q=0", "gzip"),
        ("identity;q=1, gzip;q=0.5", None),
        ("identity", None),
        ("", None),
        (";;,q=1,", None),
    ],
)
def test_a_coding_is_chosen_by_weight(accepted, coding):
    assert negotiation.preferred_coding(accepted.encode()) == coding


@pytest.mark.parametrize("coding", UNPACK)
@pytest.mark.parametrize("rest", ["clip.usda", "clip.json", "clip.bvh"])
def test_text_shrinks_and_comes_out_the_same(rest, coding, app, ask, controls):
    url = f"/v1/models/reach/{rest}?{urlencode(controls)}"
    plain, packed = raw(ask, url, "identity"), sent(app, url, coding)
    assert packed["headers"][b"content-encoding"] == coding.encode()
    assert UNPACK[coding](packed["body"]) == plain.content
    assert int(packed["headers"][b"content-length"]) == len(packed["body"])
    assert len(packed["body"]) < 0.6 * len(plain.content)
    assert packed["headers"][b"vary"] == b"Accept-Encoding" == plain.headers["vary"].encode()
    assert sent(app, url, coding)["body"] == packed["body"]
    # The same bytes at any time: the header of gzip has no time.
    assert coding != "gzip" or packed["body"][4:8] == bytes(4)


@pytest.mark.parametrize("coding", ["zstd", "gzip"])
def test_a_crowd_is_one_stream(coding, app, ask):
    url = "/v1/models/walk/crowd.usda?count=3&seconds=0.5"
    plain, packed = raw(ask, url, "identity"), sent(app, url, coding)
    if coding == "zstd":
        assert zstd.ZstdDecompressor().decompress(packed["body"]) == plain.content
    else:
        stream = zlib.decompressobj(16 + zlib.MAX_WBITS)
        assert stream.decompress(packed["body"]) == plain.content
        assert stream.eof and not stream.unused_data


def sent(app, url, accepted):
    """The answer as the app sends it."""
    path, _, query = url.partition("?")
    messages = []

    async def receive():
        return {"type": "http.request", "body": b"", "more_body": False}

    async def send(message):
        messages.append(message)

    scope = {
        "type": "http",
        "method": "GET",
        "path": path,
        "raw_path": path.encode(),
        "query_string": query.encode(),
        "http_version": "1.1",
        "headers": [(b"host", b"localhost"), (b"accept-encoding", accepted.encode())],
        "asgi": {"spec_version": "2.4"},
    }
    asyncio.run(app(scope, receive, send))
    body = b"".join(m.get("body", b"") for m in messages[1:])
    return {"headers": dict(messages[0]["headers"]), "body": body}
