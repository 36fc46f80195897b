"""Several processes on one socket: one that dies is replaced, and all end in order."""

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import httpx
import pytest
from serving import address, children, process, started, within

from service.motion.cores import ALONE
from service.web import workers

HOOKED = """
import sys
from service.web import server, settings
from service.web.workers import Hooks
def ended(process):
    print("gone", process, flush=True)
hooks = Hooks(lambda number: {"OF_ITS_OWN": f"number {number}"}, ended)
server.serve(sys.argv[1:], settings.read(), hooks)
"""


def is_alive(pid):
    return Path(f"/proc/{pid}").exists() and "\nState:\tZ" not in status(pid)


def status(pid):
    try:
        return Path(f"/proc/{pid}/status").read_text()
    except (FileNotFoundError, ProcessLookupError):
        return "\nState:\tZ"


def asked(url):
    """Whether a new connection is answered; one to a process that has just died may not be."""
    try:
        return httpx.get(url + "/readyz").status_code == 200
    except httpx.TransportError:
        return False


def test_they_say_where_they_listen_once_and_end_well(models):
    with process(models, POSEFIELD_WORKERS="3") as child:
        url = address(child)
        own = children(child.pid)
        assert len(own) == 3
        assert all(asked(url) for _ in range(20))
        child.send_signal(signal.SIGTERM)
        assert child.wait(20) == 0
        assert child.stdout.read() == child.stderr.read() == b""
        assert not any(is_alive(pid) for pid in own)


def test_one_that_is_killed_is_replaced_while_the_others_answer(models):
    with process(models, POSEFIELD_WORKERS="2") as child:
        url = address(child)
        first, second = children(child.pid)
        os.kill(first, signal.SIGKILL)
        assert all([asked(url) for _ in range(20)][2:])
        assert within(20, lambda: len(children(child.pid)) == 2)
        assert second in children(child.pid) and first not in children(child.pid)
        # The new one answers alone, too.
        os.kill(second, signal.SIGKILL)
        assert within(20, lambda: asked(url))
        child.send_signal(signal.SIGTERM)
        assert child.wait(20) == 0
        said = child.stderr.read().decode().splitlines()
        assert len(said) == 2 and all("ended by SIGKILL; another is started" in s for s in said)


@pytest.fixture
def folder(models, tmp_path):
    """A folder of models that may be taken away."""
    shutil.copytree(models, tmp_path / "models")
    return tmp_path / "models"


def test_the_last_one_is_replaced_though_a_file_is_broken_by_now(folder):
    with process(folder, POSEFIELD_WORKERS="2", POSEFIELD_RELOAD="0") as child:
        url = address(child)
        (folder / "reach.onnx").write_bytes(b"not a model")
        first, second = children(child.pid)
        os.kill(first, signal.SIGKILL)
        # Who starts now knows less than who answers, and must not.
        assert "reach.onnx" in [child.stderr.readline().decode() for _ in range(2)][1]
        models = [httpx.get(url + "/v1/models").json()["models"] for _ in range(20)]
        assert all("reach" in {model["name"] for model in found} for found in models)
        os.kill(second, signal.SIGKILL)
        assert within(30, lambda: asked(url))
        child.send_signal(signal.SIGTERM)
        assert child.wait(20) == 0


def test_one_that_cannot_be_replaced_is_told_by_the_exit_code(folder):
    with process(folder, POSEFIELD_WORKERS="2", POSEFIELD_RELOAD="0") as child:
        url = address(child)
        shutil.rmtree(folder)
        os.kill(children(child.pid)[0], signal.SIGKILL)
        lines = [child.stderr.readline().decode() for _ in range(workers.TRIES)]
        assert "ended by SIGKILL" in lines[0]
        assert all(str(folder) in line for line in lines[1:])
        assert asked(url)
        child.send_signal(signal.SIGTERM)
        assert child.wait(20) == 5
        assert b"could not be started again" in child.stderr.read()


def test_when_none_is_left_and_none_can_be_started_it_ends(folder):
    with process(folder, POSEFIELD_WORKERS="2") as child:
        address(child)
        shutil.rmtree(folder)
        for pid in children(child.pid):
            os.kill(pid, signal.SIGKILL)
        assert child.wait(60) == 3
        assert str(folder) in child.stderr.read().decode().splitlines()[-1]


def test_a_model_that_none_can_open_stops_the_start(models, tmp_path):
    broken = tmp_path / "broken.onnx"
    broken.write_bytes(b"not a model")
    with process(models, broken, POSEFIELD_WORKERS="2") as child:
        said, complaint = child.communicate(timeout=30)
        assert (child.returncode, said) == (3, b"")
        (line,) = complaint.decode().splitlines()
        assert f"{broken}: onnxruntime cannot load it" in line


def test_they_end_when_whoever_keeps_them_is_killed(models):
    with process(models, POSEFIELD_WORKERS="2") as child:
        address(child)
        own = children(child.pid)
        child.kill()
        assert within(20, lambda: not any(is_alive(pid) for pid in own))


@pytest.mark.parametrize("threads", [{}, {"OMP_NUM_THREADS": "3"}])
def test_each_has_an_environment_of_its_own_and_its_end_is_told(models, threads, monkeypatch):
    for name in ALONE:
        monkeypatch.delenv(name, raising=False)
    command = [sys.executable, "-c", HOOKED, str(models)]
    with started(command, POSEFIELD_WORKERS="2", **threads) as child:
        address(child)
        first, second = children(child.pid)
        environs = [Path(f"/proc/{pid}/environ").read_bytes() for pid in (first, second)]
        for number, environ in enumerate(environs):
            assert f"OF_ITS_OWN=number {number}".encode() in environ.split(b"\0")
            # Other workers have the other cores; who says otherwise is not overruled by a name
            # that counts more.
            said = [word for word in environ.split(b"\0") if b"_NUM_THREADS=" in word]
            expected = {f"{name}={value}".encode() for name, value in (threads or ALONE).items()}
            assert set(said) == expected
        os.kill(first, signal.SIGKILL)
        assert child.stdout.readline().decode() == f"gone {first}\n"
        assert within(20, lambda: len(children(child.pid)) == 2)
        new = next(pid for pid in children(child.pid) if pid != second)
        assert b"OF_ITS_OWN=number 0" in Path(f"/proc/{new}/environ").read_bytes().split(b"\0")
        child.send_signal(signal.SIGTERM)
        assert child.wait(20) == 0
        ends = sorted(child.stdout.read().decode().splitlines())
        assert ends == sorted(f"gone {pid}" for pid in (new, second))


@pytest.mark.parametrize(
    ("quota", "expected"), [("150000 100000", 2), ("20000 100000", 1), ("max 100000", None)]
)
def test_as_many_as_the_container_may_use(quota, expected, monkeypatch, tmp_path):
    (tmp_path / "cpu.max").write_text(f"{quota}\n")
    monkeypatch.setattr(workers, "QUOTA", tmp_path / "cpu.max")
    monkeypatch.setattr(workers.os, "sched_getaffinity", lambda _: set(range(8)))
    assert workers.processors() == (expected or 8)
    monkeypatch.setattr(workers, "QUOTA", tmp_path / "none")
    assert workers.processors() == 8


def test_as_many_as_there_are_processors(models):
    with process(models, POSEFIELD_WORKERS="0") as child:
        address(child)
        count = workers.processors()
        assert len(children(child.pid)) == (count if count > 1 else 0)
        child.send_signal(signal.SIGINT)
        assert child.wait(20) == 0


def test_ctrl_c_reaches_them_in_order(models):
    given = {**os.environ, "POSEFIELD_PORT": "0", "POSEFIELD_LOG": "off", "POSEFIELD_WORKERS": "2"}
    command = [Path(sys.executable).with_name("posefield"), "serve", str(models)]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, env=given, stdout=pipe, stderr=pipe, process_group=0) as child:
        address(child)
        os.killpg(child.pid, signal.SIGINT)
        assert child.wait(20) == 0
        assert child.stderr.read() == b""
