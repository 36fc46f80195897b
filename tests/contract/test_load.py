"""Tests of overload and deadlines: timely refusals as problem documents."""

import asyncio
import time

import httpx
import pytest
from starlette.responses import Response

from posefield.http import request, request_cycle
from posefield.http.api import contract
from posefield.http.api.settings import Settings
from posefield.http.app import build_app
from posefield.http.operations import OPERATIONS
from posefield.registry.model_registry import ModelRegistry

SOON = {"prefer": "respond-async, wait=1"}


def app_with(**handlers):
    settings = Settings(concurrency=2, deadline=60)
    return build_app(
        contract.load_contract(), {**OPERATIONS, **handlers}, ModelRegistry({}), settings
    )


async def ask_many(app, paths, **headers):
    transport = httpx.ASGITransport(app)
    async with httpx.AsyncClient(transport=transport, base_url="http://localhost") as client:
        return await asyncio.gather(*(client.get(path, headers=headers) for path in paths))


async def slow(request):
    await asyncio.sleep(0.3)
    return Response("done")


def test_more_requests_than_can_be_answered_are_turned_away():
    answers = asyncio.run(ask_many(app_with(listModels=slow), ["/v1/models"] * 5 + ["/livez"]))
    *asked, alive = answers
    assert sorted(a.status_code for a in asked) == [200, 200, 503, 503, 503]
    refused = asked[-1]
    assert refused.json()["type"] == "urn:posefield:problem:overloaded"
    assert refused.headers["retry-after"] == "1"
    # Whoever watches the service learns that it lives.
    assert alive.status_code == 200


async def stuck(request):
    await asyncio.sleep(100)


def test_an_answer_that_takes_too_long_is_given_up():
    begun = time.monotonic()
    (answer,) = asyncio.run(ask_many(app_with(listModels=stuck), ["/v1/models"], **SOON))
    assert time.monotonic() - begun < 30, "the client's patience counts, not the service's"
    assert answer.status_code == 503
    assert answer.json()["type"] == "urn:posefield:problem:late"
    assert answer.json()["detail"] == "no answer within 1 s"
    assert answer.headers["retry-after"] == "1"


@pytest.mark.parametrize(
    ("prefer", "expected"),
    [
        (None, 30.0),
        (b"wait=5", 5.0),
        (b"respond-async, Wait = 7", 7.0),
        (b"wait=99", 30.0),
        (b"wait=abc", 30.0),
        (b"await=3", 30.0),
    ],
)
def test_a_client_may_have_less_patience_but_not_more(prefer, expected):
    assert request_cycle.requested_deadline(prefer, 30.0) == expected


def test_a_task_cancelled_by_others_is_not_late():
    async def cancelled():
        watch = request.DeadlineTimer()
        task = asyncio.create_task(watch.within(30.0, asyncio.sleep(60)))
        await asyncio.sleep(0)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task

    asyncio.run(cancelled())
