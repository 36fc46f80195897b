"""Tests of the client with a service that stops during requests and restarts."""

import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

import pytest
import serving
from posefield_client import NEVER, Client, Retry, errors

pytestmark = pytest.mark.system

PATIENT = Retry(attempts=10_000, first=0.05, longest=0.05, patience=60.0)


@contextmanager
def started(models, port="0", **environ):
    """The service and its address; another may have taken the port meanwhile, and give it back."""
    for _ in range(20):
        with serving.process(models, POSEFIELD_PORT=port, **environ) as child:
            if line := child.stdout.readline().decode():
                yield child, line.split()[-1]
                return
        time.sleep(0.5)
    raise AssertionError(f"port {port} stays taken")


def port_of(address):
    return address.rpartition(":")[2]


def many(controls, count=200):
    return [{"controls": {**controls, "turn": turn / 10}, "fps": 240} for turn in range(count)]


def test_whoever_waits_is_answered_by_the_next(models, controls):
    with started(models) as (first, address):
        with Client(address, retry=PATIENT) as client:
            model = client.model("reach")
            before = model.pose(0.1, **controls)
            first.terminate()
            first.wait(20)
            with ThreadPoolExecutor(1) as other:
                # Asked while the next one starts.
                later = other.submit(model.pose, 0.2, **controls)
                with started(models, port_of(address)):
                    after = later.result()
    assert before.trust == after.trust


def test_an_archive_that_is_cut_leaves_nothing_and_comes_whole_later(models, controls, tmp_path):
    with started(models, POSEFIELD_WORKERS="1") as (first, address):
        once = threading.Event()

        def kill(progress):
            if not once.is_set():
                once.set()
                first.kill()

        with Client(address, retry=NEVER) as client:
            clips = client.model("reach").clips(many(controls), "usda")
            with pytest.raises(errors.Broken):
                clips.save(tmp_path / "clips.zip", progress=kill)
        assert list(tmp_path.iterdir()) == []
        first.wait(20)
    with started(models, port_of(address)):
        with Client(address, retry=PATIENT) as client:
            clips = client.model("reach").clips(many(controls, 20), "usda")
            assert len(clips.save(tmp_path / "clips.zip").entries) == 20
