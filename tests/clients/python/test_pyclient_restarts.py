"""The real service goes away while it is asked, and comes back."""

import socket
import threading

import pytest
import serving
from posefield_client import NEVER, Client, Retry, errors

PATIENT = Retry(attempts=10_000, first=0.05, longest=0.05, patience=60.0)


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as held:
        return str(held.getsockname()[1])


def many(controls, count=200):
    return [{"controls": {**controls, "turn": turn / 10}, "fps": 240} for turn in range(count)]


def test_whoever_waits_is_answered_by_the_next(models, controls):
    port = free_port()
    with serving.process(models, POSEFIELD_PORT=port) as first:
        with Client(serving.address(first), retry=PATIENT) as client:
            model = client.model("reach")
            before = model.pose(0.1, **controls)
            first.terminate()
            first.wait(20)
            with serving.process(models, POSEFIELD_PORT=port):
                # Asked while the next one starts.
                after = model.pose(0.2, **controls)
    assert before.trust == after.trust


def test_an_archive_that_is_cut_leaves_nothing_and_comes_whole_later(models, controls, tmp_path):
    port = free_port()
    with serving.process(models, POSEFIELD_PORT=port, POSEFIELD_WORKERS="1") as first:
        address, once = serving.address(first), threading.Event()

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
    with serving.process(models, POSEFIELD_PORT=port):
        with Client(address, retry=PATIENT) as client:
            clips = client.model("reach").clips(many(controls, 20), "usda")
            assert len(clips.save(tmp_path / "clips.zip").entries) == 20
