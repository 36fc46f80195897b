"""Tests of monitoring: Prometheus metrics and the request log."""

import asyncio
import contextlib
import json
import os
import socket
from urllib.parse import urlencode

import pytest
from asking import asker
from prometheus_client.parser import text_string_to_metric_families

from posefield.http import telemetry
from posefield.http.api.settings import Settings
from posefield.http.app import create_app


def value(page, name, **labels):
    """A sample of a page of metrics; zero where it was never counted."""
    for family in text_string_to_metric_families(page):
        for sample in family.samples:
            if sample.name == name and labels.items() <= sample.labels.items():
                return sample.value
    return 0.0


@pytest.fixture
def page(ask):
    return lambda: ask("GET", "/metrics").text


def pose(ask, controls, **headers):
    asked = urlencode({**controls, "time": 0.25})
    return ask("GET", f"/v1/models/reach/pose?{asked}", headers=headers)


def test_requests_are_counted_by_operation_and_status(ask, controls, page):
    labels = {"operation": "getPose", "format": "json"}

    def counted(status):
        return value(now, "posefield_request_seconds_count", **labels, status=status)

    now = page()
    before = [counted(status) for status in ("200", "304", "422")]
    held = value(now, "posefield_not_modified_total", **labels)
    size = value(now, "posefield_sent_bytes_total", **labels)
    first = pose(ask, controls)
    pose(ask, controls, **{"if-none-match": first.headers["etag"]})
    refused = pose(ask, {**controls, "spin": 1.0})
    now = page()
    assert [counted(s) for s in ("200", "304", "422")] == [n + 1 for n in before]
    assert value(now, "posefield_not_modified_total", **labels) == held + 1
    sent = int(first.headers["content-length"]) + len(refused.content)
    assert value(now, "posefield_sent_bytes_total", **labels) == size + sent


def test_paths_of_clients_are_no_labels(ask, page):
    ask("GET", "/nowhere/a1b2c3")
    assert "a1b2c3" not in page()
    assert value(page(), "posefield_request_seconds_count", operation="none", status="404") > 0


@pytest.fixture
def told(loaded):
    """Ask a service, and get the line that it writes of the request."""

    def asked(*args, **given):
        source, target = os.pipe()
        lines = telemetry.LogBuffer(target)
        answer = asker(create_app(loaded, Settings(), lines))(*args, **given)
        lines.flush()
        os.close(target)
        with os.fdopen(source, "rb") as found:
            written = [json.loads(line) for line in found]
        return answer, written

    return asked


def test_a_request_is_one_line(told, loaded, controls):
    url = f"/v1/models/reach/clip.usdc?{urlencode(controls)}"
    answer, (line,) = told("GET", url, headers={"x-request-id": "mine"})
    assert line["request"] == "mine"
    assert (line["operation"], line["format"]) == ("getClipInFormat", "usdc")
    assert line["model"] == loaded.find("reach").identity
    assert (line["method"], line["status"]) == ("GET", 200)
    assert line["bytes"] == len(answer.content)
    assert line["tag"] == answer.headers["etag"]
    assert 0 < line["milliseconds"] < 60_000
    assert set(line) == {*LINE}


LINE = (
    "time",
    "request",
    "trace",
    "method",
    "operation",
    "format",
    "model",
    "who",
    "tag",
    "status",
    "bytes",
    "milliseconds",
)


def test_a_line_holds_nothing_that_a_client_wrote_but_its_id(told):
    # Words that the hexadecimal ids of a line cannot spell by chance.
    _, (line,) = told("GET", "/secret/path?token=xyz", headers={"authorization": "Bearer uvw"})
    text = json.dumps(line)
    assert line["status"] == 404 and line["operation"] == "none"
    assert not any(word in text for word in ("secret", "token", "xyz", "uvw"))


async def written(contents, target):
    lines = telemetry.LogBuffer(target)
    for content in contents:
        lines.add(content)
    lines.flush()


def test_lines_are_written_whole():
    short, long = {"x": "x" * 91}, {"y": "y" * 8991}
    reader, writer = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    reader.setblocking(False)
    pieces = []
    with reader, writer, contextlib.suppress(BlockingIOError):
        asyncio.run(written([*[short] * 100, long, *[short] * 100], writer.fileno()))
        # Each datagram is the content of one system call.
        while True:
            pieces.append(reader.recv(1 << 16))
    assert [len(piece) for piece in pieces] == [4000, 4000, 2000, 9000, 4000, 4000, 2000]
    lines = [json.loads(line) for line in b"".join(pieces).splitlines()]
    assert lines == [*[short] * 100, long, *[short] * 100]
