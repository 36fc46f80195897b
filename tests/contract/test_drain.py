"""Tests of graceful shutdown: not ready, completed requests, and an end in time."""

import signal
import socket
import subprocess
import time

import httpx
import pytest
from serving import Clients, address, host_and_port, process, within

pytestmark = pytest.mark.system


def asking(url, heed=True):
    """Clients that ask on, once all of them have been answered."""
    clients = Clients(url, heed)
    assert within(30, lambda: clients.answered.total() > 300)
    return clients


@pytest.mark.parametrize("workers", ["1", "2"])
def test_behind_a_balancer_nothing_is_lost(workers, models):
    with process(models, POSEFIELD_WORKERS=workers, POSEFIELD_DRAIN="2") as child:
        clients = asking(address(child))
        child.send_signal(signal.SIGTERM)
        clients.wait()
        assert child.wait(20) == 0
    assert clients.lost == []
    # Clients that kept a connection were told to leave it.
    assert clients.answered["closing"] >= 10


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


def opened_for_good(child):
    """A connection whose request never ends."""
    wire = socket.create_connection(host_and_port(address(child)), timeout=20)
    wire.sendall(
        b"POST /v1/models/reach/pose HTTP/1.1\r\nHost: localhost\r\nContent-Length: 2\r\n"
        b"Content-Type: application/json\r\n\r\n"
    )
    time.sleep(0.2)
    return wire


def test_what_takes_too_long_is_cut_off(models):
    with process(models, POSEFIELD_GRACE="1", POSEFIELD_DRAIN="0") as child:
        with opened_for_good(child) as wire:
            child.send_signal(signal.SIGTERM)
            assert child.wait(20) == 0
            assert not wire.recv(65536).startswith(b"HTTP/1.1 2")
        assert b"graceful shutdown exceeded" in child.stderr.read()


@pytest.mark.parametrize("signals", [[signal.SIGTERM] * 2, [signal.SIGINT]])
def test_told_twice_or_by_a_person_it_does_not_drain(signals, models):
    with process(models, POSEFIELD_DRAIN="60") as child:
        address(child)
        for number, one in enumerate(signals):
            if number:
                with pytest.raises(subprocess.TimeoutExpired):
                    child.wait(1)
            child.send_signal(one)
        assert child.wait(20) == 0
