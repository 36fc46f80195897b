"""Tests of ambiguous HTTP framing, as raw bytes on a socket: the service refuses it."""

import json

import pytest
from asking import exchange, process

pytestmark = pytest.mark.system

LIVE = b"GET /livez HTTP/1.1\r\nHost: localhost\r\n\r\n"
POST = (
    b"POST /v1/models/reach/pose HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
)
CHUNKED = b"Transfer-Encoding: chunked\r\n"
REFUSED = {
    "unknown method": b"FROB / HTTP/1.1\r\nHost: localhost\r\n\r\n",
    "http/2": b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
    "bare line feeds": b"GET /livez HTTP/1.1\nHost: localhost\n\n",
    "bare carriage return": b"GET /livez HTTP/1.1\r\nHost: localhost\rA: b\r\n\r\n",
    "null in header": b"GET /livez HTTP/1.1\r\nHost: localhost\r\nA: \x00\r\n\r\n",
    "space before colon": b"GET /livez HTTP/1.1\r\nHost : localhost\r\n\r\n",
    "length and coding": POST + b"Content-Length: 4\r\n" + CHUNKED + b"\r\n0\r\n\r\n",
    "two lengths": POST + b"Content-Length: 2\r\nContent-Length: 3\r\n\r\n{}",
    "endless length": POST + b"Content-Length: " + b"9" * 40 + b"\r\n\r\n",
    "unknown coding": POST + b"Transfer-Encoding: xchunked\r\n\r\n0\r\n\r\n",
    "chunked not last": POST + b"Transfer-Encoding: chunked, identity\r\n\r\n0\r\n\r\n",
    "chunk without size": POST + CHUNKED + b"\r\nx\r\n",
    "endless chunk size": POST + CHUNKED + b"\r\n" + b"f" * 30 + b"\r\n",
}


@pytest.fixture(scope="module")
def place(models):
    """Host and port of a service."""
    with process(models) as served:
        yield served.place
        served.expect_silence()


@pytest.mark.parametrize("name", REFUSED)
def test_ambiguous_framing_is_refused_and_nothing_after_it_is_answered(name, place):
    (answer,) = exchange(place, REFUSED[name] + LIVE, answers=None)
    assert (answer.status, answer.headers["connection"]) == (400, "close")


def test_two_hosts_are_refused(place):
    (answer,) = exchange(place, LIVE.replace(b"Host", b"Host: other\r\nHost", 1))
    assert answer.status == 421


@pytest.mark.parametrize("path", ["%00", "%ff", "%", "%zz", "%c3%28", "%2e%2e%2f", "%ed%a0%80"])
def test_strange_escapes_are_no_failure(path, place):
    for url, status in [(f"/v1/models/{path}", 404), (f"/{path}", 404), (f"/livez?{path}", 400)]:
        (answer,) = exchange(place, f"GET {url} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
        assert answer.status == status, answer
        assert answer.headers["content-type"] == "application/problem+json"


def test_a_wish_for_http_2_is_not_heeded_and_its_body_not_taken_for_empty(place):
    """Send the first head of Java's client, after which httptools stops reading."""
    wish = b"Connection: Upgrade, HTTP2-Settings\r\nUpgrade: h2c\r\nHTTP2-Settings: AA\r\n"
    (answer,) = exchange(place, LIVE.replace(b"\r\n\r\n", b"\r\n" + wish + b"\r\n"))
    assert answer.status == 200
    (answer,) = exchange(place, POST + wish + b"Content-Length: 2\r\n\r\n{}")
    assert answer.status == 400
    assert "send HTTP/1.1 without `Upgrade`" in json.loads(answer.body)["detail"]
