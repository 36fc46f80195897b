"""Tests of the client's retries: conditions, waiting times and limits."""

import asyncio
import time
from email.utils import formatdate

import pytest
import scripted
from posefield_client import NEVER, AsyncClient, Client, Retry, errors
from posefield_client.cache import NOTHING
from posefield_client.errors import Unreachable
from posefield_client.exchange import Core
from posefield_client.questions import models, pose
from posefield_client.wire import Reply, Send, Sleep
from scripted import answer

LIST = answer(b'{"models": []}')
BUSY = answer(b"", "text/plain", 503)
SURE = Retry(attempts=4, first=1.0, longest=3.0, patience=20.0, chance=lambda: 1.0)


def busy(retry_after=None):
    fault = Unreachable("503")
    fault.retry_after = retry_after
    return fault


@pytest.mark.parametrize(("asked", "seconds"), [(1, 1), (2, 2), (3, 3), (4, None)])
def test_waits_double_up_to_the_longest_and_end(asked, seconds):
    assert SURE.wait(asked, busy(), 0.0) == seconds


def test_jitter_is_full():
    assert Retry(first=1.0, chance=lambda: 0.0).wait(1, busy(), 0.0) == 0.0
    assert Retry(first=1.0, chance=lambda: 0.5).wait(1, busy(), 0.0) == 0.5


def test_the_service_is_not_asked_before_it_says():
    assert SURE.wait(1, busy(2.0), 0.0) == 3.0


def test_not_at_all_where_it_wants_to_be_left_alone_for_longer_than_patience():
    assert SURE.wait(1, busy(3.5), 0.0) == 4.5
    assert SURE.wait(1, busy(19.5), 0.0) is None


def test_a_wait_is_the_longest_however_often_it_was_asked():
    assert Retry(attempts=10**6, longest=3.0, chance=lambda: 1.0).wait(5000, busy(), 0.0) == 3.0


def test_patience_ends():
    assert SURE.wait(1, busy(), 19.0) == 1.0
    assert SURE.wait(1, busy(), 19.1) is None


def test_what_would_not_change_is_not_asked_again():
    assert SURE.wait(1, errors.Unexpected("x"), 0.0) is None


def steps_of(call, retry=SURE):
    ticks = iter(range(1000))
    return Core(NOTHING, retry, bytes(32), lambda: float(next(ticks))).answer(call)


def test_the_steps_of_an_answer_that_comes_at_the_third_attempt():
    steps = steps_of(models())
    assert isinstance(next(steps), Send)
    assert steps.throw(busy()) == Sleep(1.0)
    assert isinstance(steps.send(None), Send)
    assert steps.send(Reply(503, {"retry-after": "2"}, b"")) == Sleep(4.0)
    assert isinstance(steps.send(None), Send)
    with pytest.raises(StopIteration) as ended:
        steps.send(Reply(200, {"content-type": "application/json"}, b'{"models": []}'))
    assert ended.value.value == ()


def test_a_question_by_post_is_asked_again_as_well():
    steps = steps_of(pose("reach", [0.0] * 10_000, turn=1))
    first = next(steps)
    assert first.request.operation.method == "POST"
    assert isinstance(steps.throw(busy()), Sleep)
    assert steps.send(None) == first


def test_the_last_error_is_the_one_that_is_raised():
    steps = steps_of(models(), NEVER)
    next(steps)
    fault = busy()
    with pytest.raises(Unreachable) as caught:
        steps.throw(fault)
    assert caught.value is fault


def waited(*answers):
    """Return the waits and the number of requests, equal for both clients."""
    found = []
    for ask in (by_waiting, by_awaiting):
        seconds = []
        with scripted.serving(*answers) as server:
            ask(server.address, seconds)
        found.append((seconds, len(server.asked)))
    assert found[0] == found[1]
    return found[0]


def by_waiting(address, seconds):
    with Client(address, retry=SURE, sleep=seconds.append) as client:
        assert client.models() == ()


def by_awaiting(address, seconds):
    async def sleep(given):
        seconds.append(given)

    async def ask():
        async with AsyncClient(address, retry=SURE, sleep=sleep) as client:
            assert await client.models() == ()

    asyncio.run(ask())


def test_a_service_that_starts_again():
    assert waited(b"", BUSY, LIST) == ([1.0, 2.0], 3)


def test_what_the_header_says_is_waited_for():
    told = answer(b"", "text/plain", 429, Retry_After="2")
    assert waited(told, LIST) == ([3.0], 2)


def test_an_answer_that_was_cut_is_asked_for_again():
    assert waited(LIST[:-4], LIST) == ([1.0], 2)


@pytest.mark.parametrize(("date", "seconds"), [("20:00:05", 6.0), ("19:00:00", 1.0)])
def test_a_date_is_held_against_the_services_own_clock(date, seconds):
    when = "Sat, 21 Nov 2026 {} GMT".format
    told = answer(b"", "text/plain", 503, Retry_After=when(date), Date=when("20:00:00"))
    assert waited(told, LIST) == ([seconds], 2)


def test_a_date_without_a_clock_is_held_against_ones_own():
    said = {"retry-after": formatdate(time.time() + 100), "content-type": "text/plain"}
    assert 90 < errors.of_answer(503, said, b"", "x").retry_after <= 100


@pytest.mark.parametrize("said", ["soon", "-1", "1.5", "Sat, 99 Nov 2026"])
def test_what_is_neither_seconds_nor_a_date_is_passed_over(said):
    assert waited(answer(b"", "text/plain", 503, Retry_After=said), LIST) == ([1.0], 2)
