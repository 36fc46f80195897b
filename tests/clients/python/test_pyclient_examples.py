"""Tests of the client with the contract's examples, one of each operation and kind of answer.

The asynchronous client is the same code, see test_pyclient_generated. Formats differ in a word of
the path, and long questions go by POST, see test_pyclient_questions.
"""

import json
import re
from urllib.parse import parse_qsl, urlsplit

import contract_examples
import httpx
import numpy as np
import pytest
from asking import contains
from posefield_client import Client
from posefield_client.generated import OPERATIONS


def model(client, request):
    return client.model(urlsplit(request["path"]).path.split("/")[3])


def words(request):
    """Arguments as the example says them, in the query or in the body."""
    if "body" in request:
        return dict(request["body"])
    given = {}
    for name, text in parse_qsl(urlsplit(request["path"]).query):
        given.setdefault(name, []).append(value(text))
    times = {"times": given.pop("time")} if "time" in given else {}
    targets = [target(words) for words in given.pop("target", ())]
    held = {"targets": targets} if targets else {}
    return {name: values[0] for name, values in given.items()} | times | held


def target(words):
    """A target as the client is given it, of JOINT@MOMENT:X,Y,Z."""
    joint, moment, place = re.fullmatch("(.+)@(.+):(.+)", words).groups()
    when = "at" if moment.isalpha() else "time"
    return {"joint": joint, "position": json.loads(f"[{place}]"), when: value(moment)}


def value(text):
    """A number as the client is given it, or a word."""
    try:
        return json.loads(text)
    except ValueError:
        return text


def asking(name):
    """A call of a method of a model."""
    return lambda client, r: getattr(model(client, r), name)(**words(r))


CALLS = {
    ("listModels", None): lambda client, r: client.models(),
    ("listCharacters", None): lambda client, r: client.characters(),
    ("getLiveness", None): lambda client, r: client.live(),
    ("getReadiness", None): lambda client, r: client.ready(),
    ("getModel", None): lambda client, r: model(client, r).card,
    ("getCharacter", None): lambda client, r: model(client, r).character(),
    ("getPoseInFormat", "msgpack"): asking("pose"),
    ("getWhy", None): asking("why"),
    ("getSuggestions", None): asking("suggest"),
    ("getSigmaInFormat", "msgpack"): asking("sigma"),
    ("getClipInFormat", "usdc"): asking("clip"),
    ("getClipInFormat", "msgpack"): lambda client, r: asking("clip")(client, r).numbers,
    ("getCrowdInFormat", "usda"): asking("crowd_walk"),
    ("queryCrowdInFormat", "arrow"): asking("crowd"),
    ("queryCrowdInFormat", "msgpack"): lambda client, r: asking("crowd")(client, r).numbers,
    ("queryTracksInFormat", "usdc"): asking("tracks"),
    ("queryClipsInFormat", "zip"): asking("clips"),
    ("queryPerformance", None): lambda client, r: client.plan(r["body"]),
    ("queryPerformanceInFormat", "glb"): lambda client, r: client.performance(r["body"]),
    ("queryPerformanceInFormat", "msgpack"): (
        lambda client, r: client.performance(r["body"]).numbers
    ),
    ("queryPerformancesInFormat", "tar"): lambda client, r: client.performances(**r["body"]),
}
FOR_PEOPLE = {"Viewer", "Docs", "Problems", "Contract", "ContractJson", "Metrics"}
WRAPPERS = {"listModels": "models", "queryPerformance": "trust"}
"""Keys of documents of which the client returns the only value."""


def test_every_operation_is_asked_for_or_is_for_people():
    asked, known = (
        {re.sub("^(get|query)|InFormat$", "", name) for name in names}
        for names in ([name for name, _ in CALLS], OPERATIONS)
    )
    assert asked | FOR_PEOPLE == known and not asked & FOR_PEOPLE


class Recorder(httpx.HTTPTransport):
    """The wire, and the requests that it carried."""

    def handle_request(self, request):
        self.asked = [*getattr(self, "asked", ()), request]
        return super().handle_request(request)


@pytest.mark.parametrize(("name", "form"), CALLS, ids=lambda part: part or "")
def test_it_is_asked_as_in_the_example_and_answered(name, form, address):
    request, wire = contract_examples.request(name, form), Recorder()
    with Client(address, cache_bytes=0, checks=False, transport=wire) as client:
        found = CALLS[name, form](client, request)
        found = found.content(form) if hasattr(found, "content") else found
    (sent,) = wire.asked
    assert alike(sent.method, str(sent.url.raw_path, "ascii"), sent.content) == alike(
        request["method"], request["path"], json.dumps(request.get("body", "")).encode()
    )
    if isinstance(found, bytes):
        plainly = httpx.request(
            request["method"], address + request["path"], json=request.get("body")
        )
        assert found == plainly.content
    elif (name, form) == ("getClipInFormat", "msgpack"):
        assert (found.rate, len(found.times)) == (25.0, 13)
    else:
        # Of arrays the example of the same question in JSON says what is in them.
        expected = contract_examples.response(name, form and "json")["body"]
        whole = {WRAPPERS[name]: plain(found)} if name in WRAPPERS else plain(found)
        assert contains(whole, expected)


def alike(method, target, body):
    """Return the content of a request, sorted."""
    path, _, query = target.partition("?")
    said = sorted((name, value(text)) for name, text in parse_qsl(query))
    return method, path, said, json.loads(body) if body.strip(b'"') else None


def plain(found):
    """As values that are equal or not."""
    if hasattr(found, "__struct_fields__"):
        return {name: plain(getattr(found, name)) for name in found.__struct_fields__}
    if isinstance(found, tuple):
        return [plain(each) for each in found]
    return found.tolist() if isinstance(found, np.ndarray) else found


def test_another_answer_or_request_would_be_seen():
    """Negative control of `contains` and `alike`."""
    whole = {"models": [{"name": "reach", "versions": []}]}
    assert contains(whole, {"models": [{"name": "reach"}]})
    for other in ({"models": [{"name": "walk"}]}, {"models": []}, {"total": 1}):
        assert not contains(whole, other)
    assert alike("GET", "/x?turn=20&time=0", b"") != alike("GET", "/x?turn=21&time=0", b"")
    assert alike("POST", "/x", b'{"a": 1}') != alike("POST", "/x", b'{"a": 2}')
