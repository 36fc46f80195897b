"""Tests of worker processes on one socket: replacement of dead or hung ones, and shutdown."""

import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import httpx
import pytest
from serving import address, children, host_and_port, process, started, within

from posefield.common.cancellation import SINGLE_THREAD_ENV

pytestmark = pytest.mark.system

BLOCKED = """
import socket, threading, time, uvicorn
from functools import partial
from posefield.registry.model_registry import VersionLimits, ModelRegistry
from posefield.registry.model_registry import ReloadingRegistry
from posefield.http.api import contract
from posefield.http.app import build_app
from posefield.http.server import StartAnnouncement, lifespan
from posefield.http.operations import OPERATIONS
from posefield.http.api.settings import Settings
async def block_the_loop(request):
    time.sleep(100)
own = socket.create_server(("127.0.0.1", 0))
line = StartAnnouncement("at http://127.0.0.1:%d" % own.getsockname()[1], threading.Semaphore(1))
beside = partial(lifespan, models=ReloadingRegistry([], VersionLimits()), announcement=line)
handlers = {**OPERATIONS, "listModels": block_the_loop}
settings = Settings(unresponsive=2)
agreed = contract.load_contract()
app = build_app(agreed, handlers, ModelRegistry({}), settings, None, beside)
uvicorn.Server(uvicorn.Config(app, log_level="critical", lifespan="on")).run([own])
"""


def workers(child):
    """Process ids of the workers; multiprocessing's tracker of resources is another child."""
    return [pid for pid in children(child.pid) if b"resource_tracker" not in command(pid)]


def command(pid):
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return b"resource_tracker"


def is_alive(pid):
    try:
        return "\nState:\tZ" not in Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return False


def answers(url):
    """Return whether a new connection is answered; one to a process that just died may not be."""
    try:
        return httpx.get(url + "/readyz", timeout=10).status_code == 200
    except httpx.TransportError:
        return False


@pytest.fixture
def folder(models, tmp_path):
    """A folder of models that may be taken away."""
    shutil.copytree(models, tmp_path / "models")
    return tmp_path / "models"


def test_they_say_where_they_listen_once_and_end_well(models):
    with process(models, POSEFIELD_WORKERS="3") as child:
        url = address(child)
        own = workers(child)
        assert len(own) == 3
        assert all(answers(url) for _ in range(20))
        child.send_signal(signal.SIGTERM)
        assert child.wait(30) == 0
        assert child.stdout.read() == child.stderr.read() == b""
        assert not any(is_alive(pid) for pid in own)


def replaced(child, gone, others):
    """Wait until a worker has gone and another has come, beside those that stayed."""
    found = within(60, lambda: len(now := set(workers(child)) - {gone}) == 2 and now)
    assert found and others <= found, (gone, others, workers(child))
    return found - others


def test_one_that_is_killed_is_replaced_while_the_others_answer(models):
    with process(models, POSEFIELD_WORKERS="2") as child:
        url = address(child)
        assert answers(url)
        first, second = workers(child)
        os.kill(first, signal.SIGKILL)
        assert all([answers(url) for _ in range(20)][2:])
        replaced(child, first, {second})
        # The new one answers alone, too.
        os.kill(second, signal.SIGKILL)
        assert within(30, lambda: answers(url))
        child.send_signal(signal.SIGTERM)
        assert child.wait(30) == 0
        lines = child.stderr.read().decode().splitlines()
        assert "ended by SIGKILL; process" in lines[0] and "takes its place" in lines[0]


def test_one_that_hangs_is_replaced_while_the_others_answer(models):
    with process(models, POSEFIELD_WORKERS="2", POSEFIELD_UNRESPONSIVE="3") as child:
        url = address(child)
        assert answers(url)
        first, second = workers(child)
        os.kill(first, signal.SIGSTOP)
        new = replaced(child, first, {second})
        assert not is_alive(first)
        assert new and all(answers(url) for _ in range(5))


def test_an_event_loop_that_hangs_ends_its_process_and_says_where(tmp_path):
    with started([sys.executable, "-c", BLOCKED]) as child:
        with socket.create_connection(host_and_port(address(child)), timeout=60) as wire:
            wire.sendall(b"GET /v1/models HTTP/1.1\r\nHost: localhost\r\n\r\n")
            assert child.wait(60) == 1
        assert b"block_the_loop" in child.stderr.read()


def test_one_is_replaced_though_a_file_is_broken_by_now(folder):
    with process(folder, POSEFIELD_WORKERS="2", POSEFIELD_RELOAD="0") as child:
        url = address(child)
        assert answers(url)
        (folder / "reach.onnx").write_bytes(b"not a model")
        for pid in workers(child):
            os.kill(pid, signal.SIGKILL)
        assert within(60, lambda: answers(url))
        found = httpx.get(url + "/readyz").json()
        assert [name.partition("@")[0] for name in found["models"]] == ["walk"]
        assert [fault["model"] for fault in found["reload"]["faults"]] == ["reach"]


@pytest.mark.parametrize("count", ["1", "2"])
def test_a_model_that_cannot_be_opened_stops_the_start(count, models, tmp_path):
    broken = tmp_path / "broken.onnx"
    broken.write_bytes(b"not a model")
    with process(models, broken, POSEFIELD_WORKERS=count) as child:
        said, complaint = child.communicate(timeout=60)
        assert (child.returncode, said) == (3, b"")
        (line,) = complaint.decode().splitlines()
        assert f"{broken}: does not end with its checksum" in line


def test_they_end_when_their_parent_is_killed(models):
    with process(models, POSEFIELD_WORKERS="2") as child:
        assert answers(address(child))
        own = workers(child)
        child.kill()
        assert within(30, lambda: not any(is_alive(pid) for pid in own))


@pytest.mark.parametrize("threads", [{}, {"OMP_NUM_THREADS": "3"}])
def test_numpy_has_one_thread_in_each_unless_the_operator_says_otherwise(
    models, threads, monkeypatch
):
    for name in SINGLE_THREAD_ENV:
        monkeypatch.delenv(name, raising=False)
    with process(models, POSEFIELD_WORKERS="2", **threads) as child:
        address(child)
        assert within(20, lambda: len(workers(child)) == 2)
        for pid in workers(child):
            environ = Path(f"/proc/{pid}/environ").read_bytes().split(b"\0")
            said = {word for word in environ if b"_NUM_THREADS=" in word}
            expected = {
                f"{name}={value}".encode() for name, value in (threads or SINGLE_THREAD_ENV).items()
            }
            assert said == expected


def test_ctrl_c_during_a_health_check_is_logged_as_no_death(models):
    given = {**os.environ, "POSEFIELD_PORT": "0", "POSEFIELD_LOG": "off", "POSEFIELD_WORKERS": "2"}
    posefield = [Path(sys.executable).with_name("posefield"), "serve", str(models)]
    pipe = subprocess.PIPE
    with subprocess.Popen(posefield, env=given, stdout=pipe, stderr=pipe, process_group=0) as child:
        url = address(child)
        assert within(60, lambda: answers(url) and len(workers(child)) == 2)
        first, second = workers(child)
        # The supervisor asks twice a second, and then waits for the answer.
        os.kill(first, signal.SIGSTOP)
        time.sleep(2)
        os.killpg(child.pid, signal.SIGINT)
        assert within(60, lambda: not is_alive(second))
        os.kill(first, signal.SIGCONT)
        assert child.wait(60) == 0
        assert child.stderr.read() == b""
