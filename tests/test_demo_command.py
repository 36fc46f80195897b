"""Tests of `posefield demo`: its files, the service that it starts, and how both end."""

import os
import signal
import subprocess
import sys
from contextlib import contextmanager

import httpx
import pytest
import serving
from pxr import Usd, UsdSkel

from posefield.cli import command_serve
from posefield_train.source import bvh

pytestmark = pytest.mark.system

DEMO = [sys.executable, "-m", "posefield", "demo"]
# The walk's speed is measured of the clip, and the question holds the answer to it.
EXACT = 0.01


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """The folder of a demo that has ended, and what it printed."""
    folder = tmp_path_factory.mktemp("demo")
    done = subprocess.run(
        [*DEMO, "--once", "--output", folder],
        # Settings of another service in the environment do not reach the demo's.
        env={**os.environ, "POSEFIELD_PORT": "1", "POSEFIELD_KEYS_FILE": "/none"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return folder, done.stdout


def test_every_file_is_written_and_named(made):
    folder, said = made
    assert {path.name for path in folder.iterdir()} == set(command_serve.FILES)
    for name, question in command_serve.FILES.items():
        (line,) = (line for line in said.splitlines() if f"{folder / name} " in line)
        assert f"{(folder / name).stat().st_size:,} bytes" in line and line.endswith(question)
    assert said.splitlines()[-1].startswith(f"{len(command_serve.FILES)} files in {folder}")


@pytest.mark.parametrize("speed", command_serve.SPEEDS)
def test_walks_have_the_speed_of_their_names(made, speed):
    folder, _ = made
    read = bvh.read(folder / f"walk_{speed}.bvh")
    clip = bvh.to_clip(read, metres_per_unit=0.01, up="y", root_offset="replace")
    first, last = clip.root_path[[0, -1]]
    walked = float(((last - first)[[0, 2]] ** 2).sum() ** 0.5) / clip.duration
    assert walked == pytest.approx(speed, abs=EXACT * 5)
    assert min(abs(other - speed) for other in command_serve.SPEEDS if other != speed) > 0.3
    assert (folder / f"walk_{speed}.glb").read_bytes().startswith(b"glTF")


def test_usd_files_have_characters(made):
    folder, _ = made
    counts = {}
    for path in folder.glob("*.usdc"):
        stage = Usd.Stage.Open(str(path))
        counts[path.name] = sum(prim.IsA(UsdSkel.Root) for prim in stage.TraverseAll())
    assert counts.pop("crowd.usdc") >= 50
    assert set(counts.values()) == {1} and len(counts) == len(command_serve.SPEEDS) + 5


@contextmanager
def started(words, **options):
    """Start a command and end it where the test fails, which would wait for it for ever."""
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True, **options) as child:
        try:
            yield child
        finally:
            child.terminate()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_it_stays_up_until_a_signal_and_takes_the_service_with_it(tmp_path, number):
    words = [*DEMO, "--no-browser", "--output", tmp_path]
    with started(words) as child:
        lines = iter(child.stdout.readline, "")
        address = next(line.split()[2] for line in lines if line.startswith("the page: "))
        listed = httpx.get(f"{address}v1/models").json()["models"]
        assert listed[0]["name"] == "cmu_walk", "the page opens with the first model"
        child.send_signal(number)
        assert child.wait(timeout=30) == 0
    with pytest.raises(httpx.ConnectError):
        httpx.get(f"{address}livez")


@pytest.mark.parametrize("words", [[], ["--no-browser"], ["--once"]])
def test_the_browser_is_shown_the_page_unless_told_otherwise(tmp_path, words):
    browser, seen = tmp_path / "browser", tmp_path / "seen"
    browser.write_text(f'#!/bin/sh\necho "$1" > {seen}.new && mv {seen}.new {seen}\n')
    browser.chmod(0o755)
    given = {**os.environ, "BROWSER": str(browser)}
    command = [*DEMO, *words, "--output", tmp_path / "demo"]
    with started(command, env=given) as child:
        lines = iter(child.stdout.readline, "")
        page = next((line.split()[2] for line in lines if line.startswith("the page: ")), None)
        shown = serving.within(30 if not words else 1, seen.exists)
        child.send_signal(signal.SIGINT)
        assert child.wait(timeout=30) == 0
    assert shown == (words == [])
    assert not shown or seen.read_text().strip() == page


def test_a_taken_port_is_told_and_ends_it(tmp_path, made):
    words = [*DEMO, "--once", "--port", "70000", "--output", tmp_path / "none"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 5
    assert "70000, expected 0 to 65535" in done.stderr
    assert "the service of the demo did not start: exit code 2" in done.stderr
    assert not (tmp_path / "none").exists()
