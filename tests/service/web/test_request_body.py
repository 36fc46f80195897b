"""Tests of request bodies: the limit on each, and the memory limit on all."""

import asyncio

import pytest
from starlette.requests import Request

from posefield.http.api.problems import RequestError
from posefield.http.request import FREE_BYTES, BodyMemory, read_body

LIMIT = 4 * FREE_BYTES


def request(*chunks, **headers):
    """A POST whose body arrives in chunks."""
    given = {
        "content-type": "application/json",
        **{k.replace("_", "-"): v for k, v in headers.items()},
    }
    waiting = [*chunks]

    async def receive():
        chunk = waiting.pop(0)
        return {"type": "http.request", "body": chunk, "more_body": bool(waiting)}

    raw = [(name.encode(), value.encode()) for name, value in given.items()]
    return Request({"type": "http", "method": "POST", "headers": raw}, receive)


def read(asked, memory=None):
    return asyncio.run(read_body(asked, LIMIT, memory or BodyMemory(10 * LIMIT)))


def refused(asked, memory=None):
    with pytest.raises(RequestError) as caught:
        read(asked, memory)
    return caught.value


def test_a_body_is_read_whole():
    assert read(request(b"{", b" ", b"}", content_length="3")) == b"{ }"
    assert read(request(b"{", b"}")) == b"{}"


@pytest.mark.parametrize("headers", [{}, {"content_length": str(LIMIT + 1)}])
def test_more_than_the_limit_is_refused(headers):
    fault = refused(request(b" " * LIMIT, b" ", **headers))
    assert (fault.kind.name, fault.headers["Connection"]) == ("body-too-large", "close")
    assert len(read(request(b" " * LIMIT))) == LIMIT


def test_a_body_that_the_server_did_not_read_is_no_empty_body():
    fault = refused(request(b"", content_length="12", upgrade="h2c"))
    assert fault.kind.name == "bad-body"
    assert fault.detail == "0 of 12 bytes arrived; send HTTP/1.1 without `Upgrade`"


def test_large_bodies_share_a_memory_and_small_ones_do_not_count():
    memory = BodyMemory(FREE_BYTES)
    first = request(b" " * FREE_BYTES, b" " * FREE_BYTES)
    read(first, memory)
    assert (memory.used, first.scope["body_memory"]) == (FREE_BYTES, FREE_BYTES)
    fault = refused(request(b" " * FREE_BYTES, b" "), memory)
    assert (fault.kind.name, fault.headers["Retry-After"]) == ("overloaded", "1")
    assert len(read(request(b" " * FREE_BYTES), memory)) == FREE_BYTES
    memory.release(first.scope["body_memory"])
    assert len(read(request(b" " * FREE_BYTES, b" "), memory)) == FREE_BYTES + 1


@pytest.mark.parametrize("length", ["", "x", "-1", "1e3", "9" * 30, "٣"])
def test_a_length_that_is_none_is_not_believed(length):
    asked = request(b"{}")
    asked.scope["headers"].append((b"content-length", length.encode()))
    assert read(asked) == b"{}"
