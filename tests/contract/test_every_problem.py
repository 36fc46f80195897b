"""Tests of every kind of problem over HTTP."""

import asyncio
import json

import httpx
import pytest
from asking import Answer, asker

from posefield.http.access import api_keys
from posefield.http.api import contract, problems
from posefield.http.api.problems import PROBLEM_KINDS
from posefield.http.api.settings import Settings
from posefield.http.app import build_app, create_app
from posefield.http.operations import OPERATIONS
from posefield.registry.model_registry import ModelRegistry

MODEL = "/v1/models/reach"
CLIP = f"{MODEL}/clip.json"
JSON = {"content-type": "application/json"}
CONTROLS = "stature=1.72&hip_height=0.9&target_height=1.1"


def by_request(method, path, **given):
    """Provoke by a request to a service as it usually is."""
    return lambda app: answered(asker(app)(method, path, **given))


def answered(response):
    return Answer(response.status_code, dict(response.headers), response.content)


KEY = api_keys.generate_key()


def with_key(**headers):
    """Provoke at a service with one key, which may not read metrics."""
    closed = create_app(ModelRegistry({}), Settings(keys=api_keys.key_line("one", ["read:*"], KEY)))
    return lambda app: answered(asker(closed)("GET", "/metrics", headers=headers))


async def stuck(request):
    await asyncio.sleep(100)


async def broken(request):
    raise ZeroDivisionError


def served_by(handler, concurrency=1):
    handlers = {**OPERATIONS, "listModels": handler}
    return build_app(
        contract.load_contract(), handlers, ModelRegistry({}), Settings(concurrency=concurrency)
    )


def fault(app):
    return answered(asker(served_by(broken))("GET", "/v1/models"))


def late(app):
    return answered(asker(served_by(stuck))("GET", "/v1/models", headers={"prefer": "wait=1"}))


def overloaded(app):
    async def both():
        transport = httpx.ASGITransport(served_by(stuck))
        async with httpx.AsyncClient(transport=transport, base_url="http://localhost") as client:
            asked = [client.get("/v1/models", headers={"prefer": "wait=1"}) for _ in range(2)]
            return await asyncio.gather(*asked)

    return answered((asyncio.run(both()))[1])


def not_ready(app):
    return answered(asker(create_app(ModelRegistry({}), Settings()))("GET", "/readyz"))


PROVOKED = {
    "bad-parameter": by_request("GET", f"{CLIP}?{CONTROLS}&turn=20&fps=abc"),
    "bad-body": by_request("POST", CLIP, json={"controls": {}, "fps": "fast"}),
    "unknown-host": by_request("GET", "/livez", headers={"host": "evil.example"}),
    "unauthenticated": with_key(),
    "forbidden": with_key(authorization=f"Bearer {KEY}"),
    "no-such-path": by_request("GET", "/v1/models/"),
    "unknown-model": by_request("GET", "/v1/models/reich"),
    "unknown-format": by_request("GET", f"{MODEL}/clip.fbx"),
    "method-not-allowed": by_request("PUT", f"{MODEL}/pose"),
    "not-acceptable": by_request(
        "GET", f"{MODEL}/pose?{CONTROLS}&turn=20&time=0", headers={"accept": "text/html"}
    ),
    "body-too-large": by_request("POST", CLIP, content=b" " * 65_537, headers=JSON),
    "url-too-long": by_request("GET", "/livez?" + "a" * 9000),
    "head-too-large": by_request("GET", "/livez", headers={"a": "a" * 17_000}),
    "unsupported-media-type": by_request(
        "POST", CLIP, content=b"{}", headers={"content-type": "text/plain"}
    ),
    "invalid-field": by_request("GET", f"{CLIP}?{CONTROLS}&turn=20&fps=10000"),
    "outside-samples": by_request("GET", f"{CLIP}?{CONTROLS}&turn=1000&extrapolate=refuse"),
    "out-of-reach": by_request(
        "GET", f"{CLIP}?{CONTROLS}&turn=20&extrapolate=refuse&target=RightHand@end:0,1,5"
    ),
    "internal-error": fault,
    "overloaded": overloaded,
    "late": late,
    "not-ready": not_ready,
}


# Kinds whose `errors` locate the error, and by which member.
LOCATED = {kind.name: "parameter" for kind in problems.QUERY_ERROR_PROBLEMS.values()}
LOCATED |= {"bad-parameter": "parameter", "bad-body": "pointer"}


def kinds_declared():
    return {value for value in vars(problems).values() if isinstance(value, problems.ProblemKind)}


def test_every_kind_is_provoked_here_and_is_one_of_all():
    assert set(PROVOKED) == {kind.name for kind in PROBLEM_KINDS}
    assert kinds_declared() | set(problems.QUERY_ERROR_PROBLEMS.values()) == set(PROBLEM_KINDS)


@pytest.mark.system
@pytest.mark.parametrize("kind", PROBLEM_KINDS, ids=lambda kind: kind.name)
def test_it_comes_with_its_status_title_and_link(kind, app, valid):
    answer = PROVOKED[kind.name](app)
    assert (answer.status, answer.headers["link"]) == (kind.status, kind.help)
    assert answer.headers["content-type"] == "application/problem+json"
    problem = json.loads(answer.body)
    valid("Problem", problem)
    assert (problem["type"], problem["title"]) == (kind.type, kind.title)
    assert problem["instance"] == answer.headers["x-request-id"]
    places = [name for error in problem["errors"] for name in error if name != "detail"]
    assert places == ([LOCATED[kind.name]] if kind.name in LOCATED else [])
