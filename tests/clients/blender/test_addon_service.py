"""Tests of the add-on's requests: complete responses in time, or descriptive errors."""

import json
import socket
import time

import pytest
from misbehaving import answer
from without_blender import cards, clips, faults, service
from without_blender.clips import Question
from without_blender.service import Service

CONTROLS = {"stature": 1.72, "hip_height": 0.9, "turn": 20, "target_height": 1.1}


def test_it_lists_models_and_gets_a_clip(address):
    asked = Service(address)
    names = [name for name, _ in service.models(asked)]
    assert names == ["reach", "walk"]
    card = cards.get(asked, "reach")
    clip = clips.ask(asked, Question(card.identity, CONTROLS, fps=25))
    assert clip.parents == card.parents
    assert (clip.rate, clip.trust["controls"]) == (25, CONTROLS)


def test_a_path_before_the_service_is_kept(scripted):
    server = scripted(answer(b'{"status": "live"}'))
    service.check_version(Service(server.address + "/motion/"))
    assert server.requests[0].startswith(b"GET /motion/livez ")


@pytest.mark.parametrize(
    "address",
    [
        *("", "somewhere", "ftp://host", "http://", "http://[::1", "http://host:x"),
        *("http://127.0.0.1:8123/ü", "http://host/?a=1", "http://host/#a"),
    ],
)
def test_what_is_no_address_is_refused(address):
    with pytest.raises(faults.BadAddress, match="the address is"):
        Service(address)


@pytest.mark.parametrize("host", [".x", "x" * 64])
def test_a_name_that_no_machine_can_have_is_no_address(host):
    with pytest.raises(faults.BadAddress, match="the address is"):
        service.fetch(Service(f"http://{host}"), "/livez")


@pytest.mark.parametrize("key", ["a\nX-More: 1", "schlüssel"])
def test_a_key_that_cannot_be_one_is_refused(key):
    with pytest.raises(faults.BadAddress, match="API key"):
        Service("http://127.0.0.1", key)


@pytest.mark.parametrize(
    ("address", "here", "secret"),
    [
        ("http://localhost:8000", True, True),
        ("http://127.0.0.2", True, True),
        ("http://[::1]:8000", True, True),
        ("http://192.168.1.2", False, False),
        ("https://motion.example", False, True),
        (" HTTPS://motion.example", False, True),
        ("HTTP://motion.example", False, False),
    ],
)
def test_it_knows_what_runs_here_and_what_others_could_read(address, here, secret):
    found = Service(address)
    assert (found.is_here, found.is_secret) == (here, secret)


def test_the_key_is_sent_and_goes_nowhere_else(scripted):
    other = scripted(answer(b"{}"))
    server = scripted(answer(b"", "302 Found", Location=f"{other.address}/livez"))
    with pytest.raises(faults.Unintelligible, match="sends elsewhere"):
        service.fetch(Service(server.address, "pf_secret"), "/livez")
    assert b"Authorization: Bearer pf_secret" in server.requests[0]
    assert other.requests == []


def test_what_runs_here_is_not_asked_by_a_proxy(scripted, monkeypatch):
    proxy, server = scripted(answer(b"", "403 Forbidden")), scripted(answer(b"{}"))
    monkeypatch.setenv("http_proxy", proxy.address)
    assert service.fetch(Service(server.address), "/") == b"{}"
    assert proxy.requests == []
    with pytest.raises(faults.Refused, match="403"):
        service.fetch(Service("http://motion.example"), "/")


def test_a_name_stays_in_its_place(scripted):
    server = scripted(answer(b"{}"))
    service.fetch(Service(server.address), service.path_of("../a b?c@0123"))
    assert server.requests[0].startswith(b"GET /v1/models/..%2Fa%20b%3Fc@0123 ")


def test_nobody_listens():
    with socket.create_server(("127.0.0.1", 0)) as held:
        port = held.getsockname()[1]
    with pytest.raises(faults.Unreachable, match=f"no service answers at http://127.0.0.1:{port}"):
        service.models(Service(f"http://127.0.0.1:{port}"))


@pytest.mark.parametrize(
    "pieces",
    [
        [b""] * 40,
        [b"HTTP/1.1 200 OK\r\nContent-Length: 4000\r\n\r\n", *[b"x"] * 40],
        [b"HTTP/1.1 200 OK\r\n", *[b"X-More: 1\r\n"] * 40, b"Content-Length: 0\r\n\r\n"],
        [b"HTTP/1.1 404 Not Found\r\nContent-Length: 4000\r\n\r\n", *[b"x"] * 40],
    ],
    ids=["never begins", "drop by drop", "slow head", "slow refusal"],
)
def test_a_slow_answer_ends_in_time(scripted, pieces):
    server, begun = scripted(*pieces, pause=0.1), time.monotonic()
    with pytest.raises(faults.TimedOut, match=r"did not answer within 0\.4 s"):
        service.fetch(Service(server.address, seconds=0.4), "/livez")
    assert time.monotonic() - begun < 2  # The server would go on for four.


def test_several_answers_may_take_together_what_one_may(scripted):
    said = answer(b'{"status": "live", "models": []}')
    server = scripted(said[:20], said[20:], pause=0.5)
    asked = Service(server.address, seconds=1.3)
    assert service.models(asked) == ()
    with pytest.raises(faults.TimedOut, match=r"did not answer within 1\.3 s"):
        service.models(asked.in_all())
    spent = Service(server.address, until=time.monotonic())
    with pytest.raises(faults.TimedOut):
        service.fetch(spent, "/livez")


@pytest.mark.parametrize(
    "sent",
    [
        b"HTTP/1.1 200 OK\r\nContent-Length: 100\r\n\r\nonly this",
        b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n64\r\nonly this",
        b"HTTP/1.1 200 OK\r\n\r\nonly this",
        b"HTTP/1.1 200 OK\r\n",
    ],
    ids=["by length", "in chunks", "of no length", "in its head"],
)
def test_an_answer_that_breaks_off_is_none(scripted, sent):
    with pytest.raises(faults.CutOff, match=r"broke off|does not say where it ends"):
        service.fetch(Service(scripted(sent).address), "/v1/models/reach/clip.npz", {})


def test_the_same_answers_whole_are_taken(scripted):
    for sent in (
        answer(b"all"),
        b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n3\r\nall\r\n0\r\n\r\n",
    ):
        assert service.fetch(Service(scripted(sent).address), "/") == b"all"


@pytest.mark.parametrize(
    ("said", "words"),
    [
        ({"status": "live", "contract": "2.1.0"}, r"version 2\.1\.0 .* 3\.x and 4\.x"),
        ({"status": "live", "contract": "5.0.0"}, r"version 5\.0\.0 of its interface"),
        ({"status": "fine"}, "is no posefield service"),
        ([], "answers a list"),
    ],
)
def test_another_version_or_another_service_is_refused(scripted, said, words):
    server = scripted(answer(json.dumps(said).encode()))
    with pytest.raises(faults.Unintelligible, match=words):
        service.models(Service(server.address))


@pytest.mark.parametrize("contract", [None, "3.0.0", "3.7.1", "4.0.0"])
def test_its_own_version_is_taken(scripted, contract):
    said = {"status": "live"} | ({"contract": contract} if contract else {})
    server = scripted(answer(json.dumps(said).encode()))
    assert service.check_version(Service(server.address)) is None


def test_a_page_in_place_of_json(scripted):
    server = scripted(answer(b"<html>log in</html>"))
    with pytest.raises(faults.Unintelligible, match="answers no JSON"):
        service.models(Service(server.address))


def test_a_model_that_disappeared(address):
    with pytest.raises(faults.Refused, match=r"\(404\): .*nobody") as refusal:
        clips.ask(Service(address), Question("nobody", CONTROLS))
    assert (refusal.value.status, refusal.value.kind) == (404, "unknown-model")


def test_a_refusal_says_what_was_found_and_expected(address):
    with pytest.raises(faults.Refused, match="no such control; this model has") as refusal:
        clips.ask(Service(address), Question("reach", {"spin": 1.7}))
    assert refusal.value.kind == "invalid-field"


def test_a_refusal_without_a_problem_is_one_too(scripted):
    server = scripted(answer(b"<html>", "502 Bad Gateway"))
    with pytest.raises(faults.Refused, match="502"):
        service.fetch(Service(server.address), "/")
