"""Tests of the client's retries: conditions, waiting times and limits."""

import asyncio
import random
import time

import anyio
import pytest
import scripted
from posefield_client import AsyncClient, Client, Retry
from posefield_client.errors import Unreachable
from scripted import answer

LIST = answer(b'{"models": []}')
BUSY = answer(b"", "text/plain", 503)
SURE = Retry(attempts=4, first=1.0, longest=3.0, patience=20.0)


@pytest.fixture(autouse=True)
def _longest(monkeypatch):
    """Waits are as long as chance allows."""
    monkeypatch.setattr(random, "random", lambda: 1.0)


def busy(retry_after=None):
    error = Unreachable("503")
    error.retry_after = retry_after
    return error


@pytest.mark.parametrize(
    ("attempts", "retry_after", "elapsed", "seconds"),
    [
        (1, None, 0.0, 1.0),
        (2, None, 0.0, 2.0),
        (4, None, 0.0, None),
        # The service is not asked before it says, and not at all after the patience.
        (1, 19.0, 0.0, 20.0),
        (1, 19.5, 0.0, None),
        (1, None, 19.1, None),
    ],
)
def test_waits_double_up_to_the_longest_and_end(attempts, retry_after, elapsed, seconds):
    assert SURE.wait(attempts, busy(retry_after), elapsed) == seconds


def test_jitter_is_full(monkeypatch):
    monkeypatch.setattr(random, "random", lambda: 0.5)
    assert SURE.wait(1, busy(2.0), 0.0) == 2.5


@pytest.fixture
def waited(monkeypatch):
    """Function that returns the waits and requests, equal for both clients, after answers."""
    seconds = []

    async def sleep(given):
        seconds.append(given)

    monkeypatch.setattr(anyio, "sleep", sleep)
    monkeypatch.setattr(time, "sleep", seconds.append)

    def ask(*answers):
        with scripted.serving(*answers) as server:
            with Client(server.address, retry=SURE) as client:
                assert client.models() == ()
        waits, lines = list(seconds), server.lines
        seconds.clear()

        async def later(address):
            async with AsyncClient(address, retry=SURE) as client:
                assert await client.models() == ()

        with scripted.serving(*answers) as server:
            asyncio.run(later(server.address))
        assert (seconds, server.lines) == (waits, lines)
        seconds.clear()
        return waits

    return ask


def test_a_service_that_starts_again(waited):
    assert waited(b"", BUSY, LIST) == [1.0, 2.0]


def test_an_answer_that_was_cut_is_asked_for_again(waited):
    assert waited(LIST[:-4], LIST) == [1.0]


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        ("2", 3.0),
        # A date counts from the service's own clock.
        ("Sat, 21 Nov 2026 20:00:05 GMT", 6.0),
        ("soon", 1.0),
        ("1.5", 1.0),
    ],
)
def test_the_time_of_the_header_is_waited_for(waited, text, seconds):
    date = "Sat, 21 Nov 2026 20:00:00 GMT"
    refused = answer(b"", "text/plain", 429, Retry_After=text, Date=date)
    assert waited(refused, LIST) == [seconds]
