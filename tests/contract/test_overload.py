"""Tests with clients that occupy connections, bodies or threads: small requests still succeed."""

import contextlib
import json
import socket
import threading
import time
from pathlib import Path

import httpx
import pytest
from serving import address, host_and_port, process

pytestmark = pytest.mark.system

MB = 1 << 20


def memory(pid, name="VmHWM"):
    """Peak, or present (VmRSS), resident memory of a process, MB."""
    for line in Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith(name):
            return int(line.split()[1]) / 1024
    raise LookupError(name)


@contextlib.contextmanager
def sockets(url, count):
    with contextlib.ExitStack() as stack:
        where = host_and_port(url)
        yield [
            stack.enter_context(socket.create_connection(where, timeout=30)) for _ in range(count)
        ]


def test_liveness_is_answered_beside_hundreds_of_unfinished_heads(models):
    with process(models) as child:
        url = address(child)
        with sockets(url, 700) as wires:
            for wire in wires:
                wire.sendall(b"G")
            assert {httpx.get(url + "/livez").status_code for _ in range(10)} == {200}


def test_unfinished_bodies_take_bounded_memory_and_small_ones_are_read(models, controls):
    size, limit = 16 * MB, 32 * MB
    head = (
        f"POST /v1/models/reach/crowd.arrow HTTP/1.1\r\nHost: localhost\r\n"
        f"Content-Type: application/json\r\nContent-Length: {size}\r\n\r\n"
    ).encode()

    def send(wire):
        with contextlib.suppress(OSError):
            wire.sendall(head + b" " * (size - 1))

    with process(models, POSEFIELD_BODIES_MEMORY=str(limit)) as child:
        url = address(child)
        before = memory(child.pid)
        with sockets(url, 20) as wires:
            threads = [threading.Thread(target=send, args=[wire]) for wire in wires]
            for thread in threads:
                thread.start()
            small = {"controls": controls, "times": [0.5]}
            for _ in range(10):
                assert httpx.post(url + "/v1/models/reach/pose", json=small).status_code == 200
            for wire in wires:
                # Bodies that do not fit are refused, and their connections closed already.
                with contextlib.suppress(OSError):
                    wire.shutdown(socket.SHUT_WR)
            for thread in threads:
                thread.join()
            # 20 whole bodies would be 320 MB.
            assert memory(child.pid) < before + 2.5 * limit / MB


def test_threads_of_requests_that_are_late_end_and_their_places_are_free_again(models, controls):
    targets = [
        {"joint": "RightHand", "time": 0.01 * number, "position": [(-1) ** number, 1.0, 1.0]}
        for number in range(32)
    ]
    question = json.dumps({"controls": controls, "targets": targets})
    headers = {"content-type": "application/json", "prefer": "wait=1"}
    with process(models) as child:
        url = address(child)
        answers = []

        def ask():
            answer = httpx.post(
                url + "/v1/models/reach/clip.json", content=question, headers=headers, timeout=60
            )
            answers.append(answer.status_code)

        threads = [threading.Thread(target=ask) for _ in range(40)]
        for thread in threads:
            thread.start()
        busiest = 0
        while any(thread.is_alive() for thread in threads):
            busiest = max(busiest, len(list(Path(f"/proc/{child.pid}/task").iterdir())))
            time.sleep(0.05)
        # 105 threads were at work while places were given back too early.
        assert busiest < 50 and len(answers) == 40 and set(answers) <= {200, 503}
        before = processor(child.pid)
        time.sleep(1.5)
        assert processor(child.pid) - before < 1.0, "work goes on that no client waits for"


def processor(pid):
    """Seconds that a process has computed."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / 100
