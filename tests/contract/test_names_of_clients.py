"""Tests that names, paths and addresses from clients reach neither file system nor network.

The service process reports each of Python's audit events with a client's text.
"""

import copy
import json
import os
import re
import subprocess
import sys
from pathlib import Path
from urllib.parse import quote

import pytest
from asking import exchange

pytestmark = pytest.mark.system

HERE = Path(__file__).parent
EXAMPLES = HERE.parents[1] / "api/examples"

NAMES = [
    "canary",
    "../../canary",
    "/etc/canary",
    "..%2f..%2fcanary",
    "reach@../canary",
    "canary.onnx",
    "~/canary",
    "file:///canary",
    "http://127.0.0.1:9/canary",
    "s3://canary/x",
    "@canary@</Root>",
    "C:\\canary",
    "canary\x00.usda",
    "${HOME}/canary",
    "$(touch canary)",
    "|canary",
]
HEADERS = ("X-Request-Id", "Accept", "Authorization", "Prefer", "Traceparent", "If-None-Match")


def asked():
    """The examples of the whole contract, with a file's name in each place where a word may be."""
    for folder in sorted(EXAMPLES.iterdir()):
        example = json.loads((folder / "request.json").read_bytes())
        every = [(name, changed) for name in NAMES for changed in mutations(example, name)]
        # All names in all places would be some 15,000 requests.
        yield from (
            request(c) for i, (name, c) in enumerate(every) if name == "canary" or i % 7 == 0
        )


def mutations(example, name):
    """The example with one thing changed into the name, for each thing."""
    head, _, query = example["path"].partition("?")
    parts, pairs = head.split("/"), query.split("&") if query else []
    word = quote(name, safe="%")
    for index in range(1, len(parts)):
        stem, dot, ending = parts[index].partition(".")
        for part in {word, f"{word}{dot}{ending}", f"{stem}.{word}"}:
            path = "/".join([*parts[:index], part, *parts[index + 1 :]])
            yield {**example, "path": f"{path}?{query}"}
    for index, pair in enumerate(pairs):
        key, _, value = pair.partition("=")
        for other in (f"{key}={word}", f"{word}={value}"):
            changed = [*pairs[:index], other, *pairs[index + 1 :]]
            yield {**example, "path": f"{head}?{'&'.join(changed)}"}
    for key in ("performer", "names", "format", "camera", "paths", "url", "file"):
        yield {**example, "path": f"{example['path']}{'&' if query else '?'}{key}={word}"}
    if "body" in example:
        for body in changed_bodies(example["body"], name):
            yield {**example, "body": body}
    for header in HEADERS:
        yield {**example, "headers": {**example.get("headers", {}), header: word}}


def changed_bodies(node, name):
    """The document with one value, or one key, changed into the name."""
    yield name
    items = node.items() if isinstance(node, dict) else enumerate(node)
    for key, value in items:
        inner = changed_bodies(value, name) if isinstance(value, dict | list) else [name]
        for changed in inner:
            whole = copy.copy(node)
            whole[key] = changed
            yield whole
        if isinstance(node, dict):
            yield {name if k == key else k: v for k, v in node.items()}


def request(example):
    """The bytes of a request, which ends its connection."""
    body = json.dumps(example["body"]).encode() if "body" in example else b""
    headers = {"Host": "localhost", "Connection": "close", **(example.get("headers") or {})}
    if body:
        headers |= {"Content-Type": "application/json", "Content-Length": str(len(body))}
    lines = "".join(f"{name}: {value}\r\n" for name, value in headers.items())
    return f"{example['method']} {example['path']} HTTP/1.1\r\n{lines}\r\n".encode() + body


def by_hook(models, plant):
    """Return the answers to all requests, and the process's audit events meanwhile."""
    reading, writing = os.pipe()
    environ = {"WATCH": str(writing), **({"PLANT": "1"} if plant else {})}
    answers = served(models, environ, (writing,), plant)
    os.close(writing)
    with os.fdopen(reading) as told:
        return answers, [line for line in told if not is_address(line)]


def served(models, environ, kept, plant):
    """Answers of a watched process to everything asked, or, with a planted fault, to some of it."""
    given = {
        **os.environ,
        **environ,
        "POSEFIELD_PORT": "0",
        "POSEFIELD_LOG": "off",
        "POSEFIELD_WORKERS": "1",
    }
    whole = [sys.executable, str(HERE / "watched_serve.py"), "serve", str(models)]
    with subprocess.Popen(whole, env=given, stdout=subprocess.PIPE, pass_fds=kept) as child:
        try:
            host, port = child.stdout.readline().decode().split("//")[-1].split(":")
            requests = list(asked())[: 50 if plant else None]
            answers = [exchange((host, int(port)), content) for content in requests]
            child.terminate()
            child.wait(20)
        finally:
            child.kill()
    return [answer for (answer,) in answers]


def is_address(line):
    """The client's own address, which the service is told of, has none of the client's words."""
    return re.match(r"socket\.(accept|__new__)", line)


def test_no_word_of_a_client_is_a_name_of_a_file_or_a_host(models):
    answers, told = by_hook(models, plant=False)
    assert told == []
    statuses = {answer.status for answer in answers}
    assert len(answers) > 2000
    assert {200, 400, 404, 422} <= statuses and max(statuses) < 500


def test_a_planted_look_for_a_file_is_noticed(models):
    _, told = by_hook(models, plant=True)
    assert any("/models/" in line and "canary" in line for line in told)
