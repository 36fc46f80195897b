"""Tests of the client's errors: one class per kind of problem, and one for network errors."""

import asyncio
import json

import pytest
import scripted
import serving
from posefield_client import NEVER, AsyncClient, Client, PosefieldError, errors
from posefield_client.errors import Problem, Unexpected
from posefield_client.generated import CONTRACT
from scripted import Pause, answer, chunked

from posefield.http.access import api_keys
from posefield.http.api import problems
from posefield.http.api.problems import PROBLEM_KINDS

LIST = b'{"models": []}'


def raised(address, ask=lambda client: client.models(), retry=NEVER, **given):
    """Return the error of the blocking client."""
    with Client(address, retry=retry, **given) as client, pytest.raises(PosefieldError) as caught:
        ask(client)
    return caught.value


def raised_later(address, ask=lambda client: client.models(), **given):
    """Return the error of the async client."""

    async def go():
        async with AsyncClient(address, retry=NEVER, **given) as client:
            await ask(client)

    with pytest.raises(PosefieldError) as caught:
        asyncio.run(go())
    return caught.value


def problem_example(kind):
    errors = [{"parameter": "fps", "detail": "expected a number"}]
    return problems.problem_document(kind, "fps: expected a number", "3f9c0b7a5d21", errors)


def refusal(kind):
    content = json.dumps(problem_example(kind)).encode()
    return answer(content, problems.MEDIA_TYPE, kind.status)


def test_a_problem_has_the_fields_of_its_document():
    kind = problems.NO_SUCH_PATH
    version = answer(json.dumps({"contract": CONTRACT}).encode())
    with scripted.serving(refusal(kind), version) as server:
        fault = raised(server.address)
    document = problem_example(kind)
    assert type(fault) is Problem.kinds[kind.name] is errors.NoSuchPath
    assert (fault.kind, fault.status) == (kind.name, kind.status)
    assert (fault.title, fault.detail) == (document["title"], document["detail"])
    assert fault.instance == document["instance"]
    assert [e.detail for e in fault.errors] == [e["detail"] for e in document["errors"]]
    assert document["title"] in str(fault)


def test_there_are_no_classes_of_kinds_that_are_not():
    assert set(Problem.kinds) == {kind.name for kind in PROBLEM_KINDS}


def test_a_kind_that_is_newer_than_the_client_is_a_problem():
    said = problem_example(PROBLEM_KINDS[0]) | {
        "type": "urn:posefield:problem:moon-too-full",
        "phase": 0.5,
    }
    with scripted.serving(answer(json.dumps(said).encode(), problems.MEDIA_TYPE, 400)) as server:
        fault = raised(server.address)
    assert type(fault) is Problem
    assert fault.kind == "moon-too-full"


FAR = {"joint": "RightHand", "position": (0, 1, 5), "at": "end"}


@pytest.mark.parametrize(
    ("ask", "kind"),
    [
        (lambda m, c: m("reach@0000000000000000").card, errors.UnknownModel),
        (
            lambda m, c: m("reach").pose(0, extrapolate="refuse", **c | {"turn": 1000}),
            errors.OutsideSamples,
        ),
        (
            lambda m, c: m("reach").pose(0, extrapolate="refuse", targets=[FAR], **c),
            errors.OutOfReach,
        ),
    ],
)
def test_the_service_itself_is_understood(ask, kind, address, controls):
    fault = raised(address, lambda client: ask(client.model, controls))
    later = raised_later(address, lambda client: ask(client.model, controls))
    assert type(fault) is type(later) is kind
    assert str(fault) == str(later)
    assert fault.errors


@pytest.mark.system
def test_a_service_that_wants_keys(models):
    key, other = api_keys.generate_key(), api_keys.generate_key()
    told = api_keys.key_line("one", ["read:walk"], key)
    with serving.process(models, POSEFIELD_KEYS=told) as child:
        place = serving.address(child)
        assert type(raised(place)) is errors.Unauthenticated
        assert type(raised(place, key=other)) is errors.Unauthenticated
        with Client(place, key=key) as client:
            assert [model.name for model in client.models()] == ["walk"]
        assert type(raised(place, lambda c: c.model("reach").card, key=key)) is errors.UnknownModel


def test_a_key_is_never_in_a_message():
    fault = raised_at_the_door(key="geheim\n")
    assert "geheim" not in str(fault)


def raised_at_the_door(address="http://127.0.0.1:1", **given):
    with pytest.raises(errors.WrongQuestion) as caught:
        Client(address, **given)
    return caught.value


@pytest.mark.parametrize(
    "address",
    ["localhost:8000", "", "ftp://x", "http://", "http://x:y", "http://x?", "http://x/#y"],
)
def test_an_address_that_is_none(address):
    assert repr(address) in str(raised_at_the_door(address))


@pytest.mark.parametrize(
    ("said", "kind"),
    [
        (b"SSH-2.0-OpenSSH_9\r\n\r\n", errors.Unreachable),
        (answer(b"<html>", "text/html", 502), errors.Unreachable),
        ([answer(LIST)[:-3], Pause(1)], errors.TimedOut),
        (answer(LIST)[:-3], errors.Broken),
        (chunked(LIST, ended=False, kind="application/json"), errors.Broken),
    ],
)
def test_what_breaks_on_the_way(said, kind):
    # Each has a server of its own: one that is slow still sleeps.
    for ask in (raised, raised_later):
        with scripted.serving(said) as server:
            assert type(ask(server.address, timeout=0.2 if type(said) is list else 60)) is kind
        assert len(server.asked) == 1


@pytest.mark.parametrize(
    "said",
    [
        answer(b"<html>welcome</html>", "text/html"),
        answer(b"{}"),
        answer(b"", status=302, Location="https://elsewhere.example/"),
        answer(b"", status=304),
    ],
)
def test_an_answer_of_another_version_says_of_which(said):
    version = answer(b'{"status": "live", "contract": "9.1.0"}')
    with scripted.serving(said, version, said, version) as server:
        fault, later = raised(server.address), raised_later(server.address)
    assert type(fault) is type(later) is Unexpected
    assert (fault.service, fault.client) == ("9.1.0", CONTRACT)
    assert str(fault) == str(later)
    assert f"the service has contract 9.1.0, this client {CONTRACT}" in str(fault)
    assert [line for line in server.lines if line != "GET /v1/models"] == ["GET /livez"] * 2


@pytest.mark.parametrize("status", [429, 504])
@pytest.mark.parametrize(
    ("said", "kind"),
    [
        (b'{"title": "Busy"}', errors.Unreachable),
        (
            json.dumps(problem_example(PROBLEM_KINDS[0]) | {"type": "about:blank"}).encode(),
            errors.Busy,
        ),
    ],
)
def test_a_gateways_own_problem_is_asked_again(said, kind, status):
    for media_type in (problems.MEDIA_TYPE, f"{problems.MEDIA_TYPE} ; charset=utf-8"):
        with scripted.serving(answer(said, media_type, status, Retry_After="7")) as server:
            fault = raised(server.address)
        assert type(fault) is kind
        assert fault.again
        assert fault.retry_after == 7
