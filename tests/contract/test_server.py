"""Tests of the server process on a real socket: responses, shutdown and invalid models."""

import socket
import threading

import httpx
import pytest
from serving import address, host_and_port, process, within

pytestmark = pytest.mark.system


@pytest.fixture(scope="module")
def base(models):
    with process(models) as child:
        yield address(child)


def test_requests_at_the_same_time_do_not_disturb_each_other(base, controls):
    answers = {}

    def ask(stature):
        with httpx.Client(base_url=base, timeout=30) as client:
            given = {**controls, "stature": stature, "fps": 1000}
            answers[stature] = client.get("/v1/models/reach/clip.usda", params=given).content

    statures = [1.6 + 0.02 * i for i in range(8)]
    threads = [threading.Thread(target=ask, args=(stature,)) for stature in statures]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    together = dict(answers)
    for stature in statures:
        ask(stature)
    assert answers == together


def test_a_taken_port_stops_the_start(models):
    with socket.create_server(("127.0.0.1", 0)) as held:
        port = held.getsockname()[1]
        with process(models, POSEFIELD_PORT=str(port)) as child:
            _, complaint = child.communicate(timeout=30)
            assert child.returncode != 0
            assert "address already in use" in complaint.decode()


def test_open_requests_are_counted_once_a_second(models):
    def counted(url):
        (line,) = [
            line
            for line in httpx.get(url + "/metrics").text.splitlines()
            if line.startswith("posefield_open_requests ")
        ]
        return float(line.split()[1])

    with process(models) as child:
        url = address(child)
        with socket.create_connection(host_and_port(url), timeout=20) as wire:
            wire.sendall(
                b"POST /v1/models/reach/pose HTTP/1.1\r\nHost: localhost\r\nContent-Length: 2\r\n"
                b"Content-Type: application/json\r\n\r\n"
            )
            assert within(10, lambda: counted(url) == 1.0)
        assert within(10, lambda: counted(url) == 0.0)
