"""Told to end, the service answers everybody whom it let in, and sends them away."""

import json
import signal
import socket
import subprocess
import sys
import time

import httpx
import pytest
from serving import Crowd, address, exchange, host_and_port, process, started, within

PLAIN = """
import socket, sys, uvicorn
from service.synthesis import library
from service.web.app import create_app
from service.web.settings import Settings
own = socket.create_server(("127.0.0.1", 0), backlog=2048)
print("at http://127.0.0.1:%d" % own.getsockname()[1], flush=True)
app = create_app(library.load([sys.argv[1]]), Settings())
uvicorn.Server(uvicorn.Config(app, log_level="critical")).run([own])
"""


@pytest.mark.parametrize("workers", ["1", "2"])
def test_under_load_nothing_is_lost(workers, models):
    with process(models, POSEFIELD_WORKERS=workers) as child:
        crowd = Crowd(address(child))
        assert within(20, lambda: crowd.answered.total() > 300)
        child.send_signal(signal.SIGTERM)
        crowd.wait()
        assert child.wait(20) == 0
    assert crowd.lost == []
    # Whoever kept a connection was told to leave it.
    assert crowd.answered["closing"] >= 10


def test_those_clients_would_notice_a_loss(models):
    """Negative control: uvicorn's own server resets whom it has not accepted yet."""
    for _ in range(5):
        with started([sys.executable, "-c", PLAIN, str(models)]) as child:
            crowd = Crowd(address(child))
            assert within(20, lambda crowd=crowd: crowd.answered.total() > 300)
            child.send_signal(signal.SIGTERM)
            crowd.wait()
        if crowd.lost:
            break
    assert crowd.lost


def test_it_listens_on_for_a_while_but_is_not_ready(models):
    with process(models, POSEFIELD_DRAIN="3") as child:
        url = address(child)
        with httpx.Client(base_url=url) as client:
            assert "connection" not in client.get("/readyz").headers
            child.send_signal(signal.SIGTERM)
            assert within(2, lambda: client.get("/readyz").status_code == 503)
            problem = client.get("/readyz").json()
            assert problem["type"] == "urn:posefield:problem:not-ready"
            answer = httpx.get(url + "/v1/models")
            assert (answer.status_code, answer.headers["connection"]) == (200, "close")
            assert httpx.get(url + "/livez").status_code == 200
        assert child.wait(20) == 0
        with pytest.raises(httpx.ConnectError):
            httpx.get(url + "/livez")


def test_an_idle_connection_does_not_hold_the_end_up(models):
    with process(models) as child, socket.create_connection(host_and_port(address(child))) as wire:
        assert not exchange(wire)
        child.send_signal(signal.SIGTERM)
        assert child.wait(5) == 0
        assert wire.recv(1) == b""


def test_a_head_that_has_begun_is_waited_for(models):
    with process(models) as child, socket.create_connection(host_and_port(address(child))) as wire:
        wire.settimeout(20)
        wire.sendall(b"GET /livez HTTP/1.1\r\nHo")
        time.sleep(0.2)
        child.send_signal(signal.SIGTERM)
        time.sleep(1.5)
        wire.sendall(b"st: x\r\n\r\n")
        answer = wire.recv(65536)
        assert answer.startswith(b"HTTP/1.1 200 ") and b"connection: close" in answer
        assert child.wait(5) == 0


def test_whoever_is_being_answered_may_ask_once_more(models, controls):
    """The head of that answer has gone, and could not say that it was the last."""
    with process(models) as child, socket.create_connection(host_and_port(address(child))) as wire:
        wire.settimeout(20)
        wire.sendall(archive(controls))
        answer = wire.makefile("rb")
        head = [answer.readline() for _ in range(5)]
        child.send_signal(signal.SIGTERM)
        time.sleep(1.0)
        while line := answer.readline().strip():
            head.append(line)
        assert head[0].startswith(b"HTTP/1.1 200 ") and b"connection: close" not in head
        while size := int(answer.readline(), 16):
            answer.read(size + 2)
        answer.readline()
        time.sleep(0.1)
        assert exchange(wire)
        assert child.wait(20) == 0


def archive(controls):
    """Question for more than the buffers of a socket hold."""
    clips = [{"controls": controls, "fps": 500, "end": 0.5}] * 200
    body = json.dumps({"format": "json", "clips": clips}).encode()
    return (
        b"POST /v1/models/reach/clips.zip HTTP/1.1\r\nHost: x\r\nContent-Length: %d\r\n"
        b"Content-Type: application/json\r\n\r\n%b" % (len(body), body)
    )


def opened_for_good(child):
    """A connection whose request never ends."""
    wire = socket.create_connection(host_and_port(address(child)), timeout=20)
    wire.sendall(
        b"POST /v1/models/reach/pose HTTP/1.1\r\nHost: x\r\nContent-Length: 2\r\n"
        b"Content-Type: application/json\r\n\r\n"
    )
    time.sleep(0.2)
    return wire


def test_what_takes_too_long_is_cut_off_and_told(models):
    with process(models, POSEFIELD_GRACE="1") as child, opened_for_good(child) as wire:
        child.send_signal(signal.SIGTERM)
        assert child.wait(10) == 0
        assert wire.recv(1) == b""
        assert child.stderr.read() == b"1 connections were cut off: their time was over\n"


def test_told_twice_it_ends_at_once(models):
    with process(models, POSEFIELD_GRACE="60", POSEFIELD_DRAIN="60") as child:
        with opened_for_good(child):
            child.send_signal(signal.SIGTERM)
            with pytest.raises(subprocess.TimeoutExpired):
                child.wait(1)
            child.send_signal(signal.SIGTERM)
            assert child.wait(10) == 0
