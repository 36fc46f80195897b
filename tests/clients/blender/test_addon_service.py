"""Tests of the add-on's requests: complete responses in time, or descriptive errors."""

import json
import socket
import time

import pytest
from misbehaving import answer
from without_blender import card as cards
from without_blender.service import Fault, Service

CONTROLS = {"stature": 1.72, "hip_height": 0.9, "turn": 20, "target_height": 1.1}
CLIP = "/v1/models/reach/clip.glb"


def test_it_lists_models_and_gets_a_clip_with_its_trust(address):
    asked = Service(address, seconds=60)
    assert [name for name, _ in cards.models(asked)] == ["reach", "walk"]
    clip = asked.fetch(CLIP, {"controls": CONTROLS, "fps": 25})
    assert clip.content.startswith(b"glTF")
    (said,) = clip.sentences
    assert said.startswith("off by about ") and said.endswith("captured near here")
    far = asked.fetch(CLIP, {"controls": {**CONTROLS, "turn": 1000}}).sentences
    assert "nothing like it was captured" in far[0] and "turn" in far[1]


def test_a_path_before_the_service_is_kept(scripted):
    server = scripted(answer(b'{"status": "live", "contract": "5.0.0"}'))
    Service(server.address + "/motion/").check_version()
    assert server.requests[0].startswith(b"GET /motion/livez ")


@pytest.mark.parametrize(
    "address",
    ["", "somewhere", "ftp://host", "http://[::1", "http://host:x", "http://host/ü", "http://h/?a"],
)
def test_what_is_no_address_is_refused(address):
    with pytest.raises(Fault, match="the address is"):
        Service(address)


def test_a_key_that_cannot_be_one_is_refused():
    with pytest.raises(Fault, match="API key"):
        Service("http://127.0.0.1", "a\nX-More: 1")


@pytest.mark.parametrize(
    ("address", "here", "secret"),
    [
        ("http://localhost:8000", True, True),
        ("http://127.0.0.2", True, True),
        ("http://[::1]:8000", True, True),
        ("http://192.168.1.2", False, False),
        (" HTTPS://motion.example", False, True),
    ],
)
def test_it_knows_what_runs_here_and_what_others_could_read(address, here, secret):
    service = Service(address)
    assert (service.is_here, service.is_secret) == (here, secret)


def test_the_key_is_sent_and_goes_nowhere_else(scripted):
    other = scripted(answer(b"{}"))
    server = scripted(answer(b"", "302 Found", Location=f"{other.address}/livez"))
    with pytest.raises(Fault, match="sends elsewhere"):
        Service(server.address, "pf_secret").fetch("/livez")
    assert b"Authorization: Bearer pf_secret" in server.requests[0]
    assert other.requests == []


def test_what_runs_here_is_not_asked_by_a_proxy(scripted, monkeypatch):
    proxy, server = scripted(answer(b"", "403 Forbidden")), scripted(answer(b"{}"))
    monkeypatch.setenv("http_proxy", proxy.address)
    assert Service(server.address).fetch("/").content == b"{}"
    assert proxy.requests == []
    with pytest.raises(Fault, match="403"):
        Service("http://motion.example").fetch("/")


def test_nobody_listens():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    with pytest.raises(Fault, match=f"no service answers at http://127.0.0.1:{port}"):
        cards.models(Service(f"http://127.0.0.1:{port}"))


@pytest.mark.parametrize(
    "pieces",
    [[b""] * 30, [b"HTTP/1.1 200 OK\r\nContent-Length: 4000\r\n\r\n", *[b"x"] * 30]],
    ids=["never begins", "drop by drop"],
)
def test_a_slow_answer_ends_in_time(scripted, pieces):
    server, begun = scripted(*pieces, pause=0.1), time.monotonic()
    with pytest.raises(Fault, match=r"did not answer within 0\.4 s"):
        Service(server.address, seconds=0.4).fetch("/livez")
    assert time.monotonic() - begun < 2  # The server would go on for three.


@pytest.mark.parametrize(
    "sent",
    [
        b"HTTP/1.1 200 OK\r\nContent-Length: 100\r\n\r\nonly this",
        b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n64\r\nonly this",
    ],
    ids=["by length", "in chunks"],
)
def test_an_answer_that_breaks_off_is_none(scripted, sent):
    with pytest.raises(Fault, match=r"broke off|IncompleteRead"):
        Service(scripted(sent).address).fetch(CLIP, {})


@pytest.mark.parametrize(
    ("said", "words"),
    [
        ({"status": "live", "contract": "4.1.0"}, r"version 4\.1\.0 .* 5\.x"),
        ({"status": "fine"}, "is no posefield service"),
        ([], "answers a list"),
    ],
)
def test_another_version_or_another_service_is_refused(scripted, said, words):
    with pytest.raises(Fault, match=words):
        cards.models(Service(scripted(answer(json.dumps(said).encode())).address))


def test_a_page_in_place_of_json(scripted):
    with pytest.raises(Fault, match="answers no JSON"):
        cards.models(Service(scripted(answer(b"<html>log in</html>")).address))


def test_a_refusal_says_what_was_found_and_expected(address, scripted):
    asked = Service(address, seconds=60)
    with pytest.raises(Fault, match=r"\(422\): .*no such control; this model has"):
        asked.fetch(CLIP, {"controls": {"spin": 1.7}})
    with pytest.raises(Fault, match=r"\(404\): .*nobody"):
        cards.fetch(asked, "nobody")
    with pytest.raises(Fault, match="502"):
        Service(scripted(answer(b"<html>", "502 Bad Gateway")).address).fetch("/")
