"""Tests of streamed archives on a real socket: back-pressure, memory and truncation on errors."""

import dataclasses
import io
import logging
import time
import zipfile
from pathlib import Path

import httpx
import pytest
from asking import listening
from test_server import address, process

from posefield.batch.clip_files import SENT_CLIPS
from posefield.encode.archives import ARCHIVE_WRITERS
from posefield.encode.formats import CLIP_ENCODERS
from posefield.http.api.settings import Settings
from posefield.http.app import create_app

PATH = "/v1/models/reach/clips"
MANY = 1000


def counting(most=MANY):
    """An encoder of usdc that counts what it has made, and fails beyond so many."""
    made, usdc = [], CLIP_ENCODERS["usdc"]

    def write(answers, convention):
        made.extend(answers)
        if len(made) > most:
            raise RuntimeError("out of everything")
        return usdc.write(answers, convention)

    return dataclasses.replace(usdc, write=write), made


@pytest.fixture
def served(loaded, monkeypatch):
    """The application with one encoder in place of the others for many clips."""

    def serve(encoder):
        monkeypatch.setitem(CLIP_ENCODERS, "usdc", encoder)
        return create_app(loaded, Settings())

    return serve


def asked(controls, count, extension="usdc"):
    return {"format": extension, "clips": [{"controls": controls}] * count}


def settled(made):
    """Return the final number of clips made."""
    count = -1
    while count != len(made):
        count = len(made)
        time.sleep(0.5)
    return count


@pytest.mark.parametrize("kind", ARCHIVE_WRITERS)
def test_work_waits_for_a_client_that_reads_slowly_and_ends_when_it_goes(kind, served, controls):
    encoder, made = counting()
    with listening(served(encoder)) as base, httpx.Client(timeout=30) as client:
        body = asked(controls, MANY)
        with client.stream("POST", f"{base}{PATH}.{kind}", json=body) as answer:
            assert next(answer.iter_raw())
            waiting = settled(made)
            assert waiting < MANY / 2
        assert settled(made) <= waiting + SENT_CLIPS


@pytest.mark.parametrize("kind", ARCHIVE_WRITERS)
def test_an_archive_that_cannot_be_finished_breaks_off(kind, served, controls, caplog):
    encoder, _ = counting(most=2 * SENT_CLIPS)
    got = bytearray()
    headers = {"x-request-id": "id-7"}
    with (
        listening(served(encoder)) as base,
        caplog.at_level(logging.ERROR),
        pytest.raises(httpx.RemoteProtocolError, match="incomplete chunked read"),
        httpx.stream(
            "POST", f"{base}{PATH}.{kind}", json=asked(controls, MANY), headers=headers
        ) as answer,
    ):
        assert answer.status_code == 200
        for chunk in answer.iter_raw():
            got += chunk
    # An archive ends with what follows the manifest: the index of a zip, the zeros of a tar.
    assert 0 < len(got) and b"manifest.jsonl" not in got
    assert not got.endswith(bytes(1024))
    if kind == "zip":
        with pytest.raises(zipfile.BadZipFile):
            zipfile.ZipFile(io.BytesIO(got))
    assert "request id-7 failed" in caplog.text and "out of everything" in caplog.text


def highest(child):
    """Most memory that a process has held, bytes."""
    status = Path(f"/proc/{child.pid}/status").read_text()
    return 1024 * int(status.partition("VmHWM:")[2].split()[0])


@pytest.mark.system
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="no /proc here")
def test_memory_does_not_grow_with_the_number_of_clips(models, controls):
    with process(models) as child:
        base = address(child)
        few, small = peak(child, f"{base}{PATH}.zip", asked(controls, 50, "json"))
        many, large = peak(child, f"{base}{PATH}.zip", asked(controls, 2000, "json"))
    # 2,000 questions and their lines in the manifest take some 4 MB; their files take 100.
    assert many - few < 12e6
    assert large - small > 80e6


def peak(child, url, body):
    """Most memory held so far, and the size of the answer."""
    with httpx.stream("POST", url, json=body, timeout=60) as answer:
        size = sum(map(len, answer.iter_raw()))
    return highest(child), size
